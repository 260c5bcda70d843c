// `?show=glb` by three.js and its plugin for KHR_gaussian_splatting, `?show=3dtiles` by 3d-tiles-renderer with it.
import { TilesRenderer } from "3d-tiles-renderer/three";
import { GLTFExtensionsPlugin } from "3d-tiles-renderer/three/plugins";
import * as THREE from "three/webgpu";
import { GLTFGaussianSplatLoaderExtension } from "three/addons/loaders/GLTFGaussianSplatLoaderExtension.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const LAST = 12; // frames after all is loaded
const show = new URLSearchParams(location.search).get("show") ?? "glb", told = document.querySelector("p");
const renderer = new THREE.WebGPURenderer({ antialias: true }), scene = new THREE.Scene();
const side = (await (await fetch("/exports/terrain/terrain.json")).json()).tile_side;
const camera = new THREE.PerspectiveCamera(45, innerWidth / innerHeight, 0.01 * side, 100 * side);
const splats = (parser) => new GLTFGaussianSplatLoaderExtension(parser);

async function openGlb() {
  const loader = new GLTFLoader();
  loader.register(splats);
  scene.add((await loader.loadAsync("/exports/terrain/terrain.glb")).scene);
  return () => true;
}

/** 3D Tiles have z up. Returns: what refines them for a frame, and says whether all that it needs is there. */
function openTiles() {
  const tiles = new TilesRenderer("/exports/terrain/terrain_3dtiles/tileset.json");
  tiles.registerPlugin(new GLTFExtensionsPlugin({ plugins: [splats] }));
  tiles.setCamera(camera);
  tiles.setResolutionFromRenderer(camera, renderer);
  tiles.group.rotation.x = -Math.PI / 2;
  scene.add(tiles.group);
  return () => {
    tiles.update();
    return tiles.visibleTiles.size > 0 && tiles.loadProgress === 1;
  };
}

await renderer.init();
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
scene.background = new THREE.Color(0xb8cbdc);
camera.position.set(-1.1 * side, 0.8 * side, 1.7 * side);
camera.lookAt(0.2 * side, 0, -0.2 * side);
camera.updateMatrixWorld();
const isWhole = show === "glb" ? await openGlb() : openTiles();
let frames = 0;
renderer.setAnimationLoop(() => {
  const whole = isWhole();
  renderer.render(scene, camera);
  frames = whole ? frames + 1 : 0;
  told.textContent = `terrain.${show}, frame ${frames}`;
  if (frames === LAST) renderer.setAnimationLoop(null);
});
