// splats.ply by Spark in three.js: the eye is the origin, z is up.
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
import * as THREE from "three";

export async function open({ width, height, fov }) {
  const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
  const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(fov, width / height, 0.001, 1e4);
  renderer.setPixelRatio(1);
  renderer.setSize(width, height);
  document.body.append(renderer.domElement);
  const splats = new SplatMesh({ url: "splats.ply" });
  await splats.initialized;
  scene.add(new SparkRenderer({ renderer, preBlurAmount: 0.3, blurAmount: 0, maxStdDev: 3.33, minAlpha: 1 / 255 }), splats);
  camera.up.set(0, 0, 1);
  return {
    gl: renderer.getContext(),
    draw(ahead) {
      camera.lookAt(...ahead);
      renderer.render(scene, camera);
    },
  };
}
