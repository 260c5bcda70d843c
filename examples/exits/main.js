// One export after the other in one view: `?show=spz`, `ply` or `sog` by Spark, `glb_points` and `ground` by three.js alone.
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const LAST = 12; // frames after Spark's sorter has answered: nothing moves
const show = new URLSearchParams(location.search).get("show") ?? "spz", told = document.querySelector("p");
const renderer = new THREE.WebGLRenderer({ antialias: true }), scene = new THREE.Scene();
const read = async (file) => (await new GLTFLoader().loadAsync(`/exports/${file}`)).scene;

let spark = null;

/** Files with y down, as fields of COLMAP's cameras have it, are turned about x. */
async function openSplats(url, down) {
  const mesh = new SplatMesh({ url });
  await mesh.initialized;
  if (down) mesh.quaternion.set(1, 0, 0, 0);
  spark = new SparkRenderer({ renderer, preBlurAmount: 0.3, blurAmount: 0 });
  scene.add(spark, mesh);
}

/** Whether the picture is whole: Spark sorts in a worker, which takes as long as the machine is busy. */
const isSorted = () => !spark || (spark.activeSplats > 0 && !spark.sorting && !spark.sortDirty);

/** Without the plugin for KHR_gaussian_splatting, which needs WebGPU, three.js shows points. */
async function openPoints() {
  const points = await read("terrain/terrain.glb");
  points.traverse((object) => object.isPoints && Object.assign(object.material, { size: 2, sizeAttenuation: false }));
  scene.add(points);
}

async function openGround() {
  const sun = new THREE.DirectionalLight(0xffffff, 3), parts = await Promise.all(["ground/ground.glb", "ground/objects.glb"].map(read));
  const colours = [0xc4a27c, 0x7a8060];
  parts.forEach((part, k) => part.traverse((object) => {
    if (object.isMesh) object.material = new THREE.MeshStandardMaterial({ color: colours[k], flatShading: true });
  }));
  sun.position.set(-3, 2, 1);
  scene.add(...parts, sun, new THREE.HemisphereLight(0xffffff, 0x808080, 0.8));
}

const side = (await (await fetch("/exports/terrain/terrain.json")).json()).tile_side;
if (show === "glb_points") await openPoints();
else if (show === "ground") await openGround();
else await openSplats(`/exports/terrain/terrain.${show}`, show !== "spz");

const camera = new THREE.PerspectiveCamera(45, innerWidth / innerHeight, 0.01 * side, 100 * side);
camera.position.set(-1.1 * side, 0.8 * side, 1.7 * side);
camera.lookAt(0.2 * side, 0, -0.2 * side);
scene.background = new THREE.Color(0xb8cbdc);
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
let frames = 0;
renderer.setAnimationLoop(() => {
  renderer.render(scene, camera);
  frames = isSorted() ? frames + 1 : 0;
  told.textContent = `terrain.${show}, frame ${frames}`;
  if (frames === LAST) renderer.setAnimationLoop(null);
});
