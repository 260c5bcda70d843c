// Walking on an exported terrain in three.js: Spark draws its SPZ, terrain_api.js knows how high the ground is.
// W A S D walk, dragging looks. three.js has y up: our (x, y, z) is its (x, z, -y).
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
import * as THREE from "three";
import { load } from "/page/terrain_api.js";

const told = document.querySelector("p"), SPEED = 1.5; // eye heights a second
const place = { x: 0, y: 0, eye: 0, yaw: 60, pitch: -12 }, held = new Set(), asked = new URLSearchParams(location.search);
const EXPORT = "/exports/terrain/";

/** What lies where: the export's own coordinates count from its `origin`. */
async function open() {
  const response = await fetch(`${EXPORT}terrain.json`);
  if (!response.ok) throw new Error("There is no export: see docs/tutorials/three-js.md");
  const facts = await response.json(), terrain = await load("/page/");
  terrain.end(); // heights need no tiles
  const splats = new SplatMesh({ url: `${EXPORT}terrain.spz` });
  await splats.initialized;
  return { facts, terrain, splats };
}

const { facts, terrain, splats } = await open();
const { origin, cells: { west, south, columns, rows }, tile_side: side } = facts;
Object.assign(place, { x: origin[0], y: origin[1], eye: terrain.eyeFloor });
for (const key of Object.keys(place)) place[key] = Number(asked.get(key) ?? place[key]);

const renderer = new THREE.WebGLRenderer(), scene = new THREE.Scene();
document.body.append(renderer.domElement);
const spark = new SparkRenderer({ // as the terrain was made: a dilation of 0.3 square pixels, order by depth
  renderer, preBlurAmount: 0.3, blurAmount: 0, maxStdDev: 3.33, minAlpha: 1 / 255, sortRadial: false,
});
const camera = new THREE.PerspectiveCamera(60, 1, 0.1 * terrain.eyeFloor, 100 * side);
scene.background = new THREE.Color(0.5, 0.5, 0.5).convertSRGBToLinear();
scene.add(spark, splats);

/** Stay on the exported cells, and stand on the ground. */
function stand() {
  place.x = Math.min(Math.max(place.x, west * side), (west + columns) * side);
  place.y = Math.min(Math.max(place.y, south * side), (south + rows) * side);
  const z = terrain.height(place.x, place.y) + place.eye - origin[2];
  camera.position.set(place.x - origin[0], z, origin[1] - place.y);
  camera.rotation.set(THREE.MathUtils.degToRad(place.pitch), THREE.MathUtils.degToRad(place.yaw - 90), 0, "YXZ");
}

/** @param {number} seconds */
function walk(seconds) {
  const ahead = held.has("w") - held.has("s"), right = held.has("d") - held.has("a");
  const yaw = THREE.MathUtils.degToRad(place.yaw), step = SPEED * place.eye * seconds;
  place.x += step * (ahead * Math.cos(yaw) + right * Math.sin(yaw));
  place.y += step * (ahead * Math.sin(yaw) - right * Math.cos(yaw));
}

function resize() {
  const { innerWidth: width, innerHeight: height } = window, long = Math.max(width, height);
  renderer.setSize(width, height);
  camera.aspect = width / height; // 60 degrees along the longer side
  camera.fov = THREE.MathUtils.radToDeg(2 * Math.atan((Math.tan(Math.PI / 6) * height) / long));
  camera.updateProjectionMatrix();
}

let last = 0, frames = 0;
addEventListener("resize", resize);
addEventListener("keydown", ({ key }) => held.add(key.toLowerCase()));
addEventListener("keyup", ({ key }) => held.delete(key.toLowerCase()));
renderer.domElement.addEventListener("pointermove", ({ buttons, movementX, movementY }) => {
  if (!buttons) return;
  place.yaw += 0.2 * movementX;
  place.pitch = Math.min(Math.max(place.pitch + 0.2 * movementY, -89), 89);
});
resize();
renderer.setAnimationLoop((now) => {
  walk(Math.min(now - last, 100) / 1000);
  last = now;
  stand();
  renderer.render(scene, camera);
  const sorting = !spark.activeSplats || spark.sorting || spark.sortDirty ? ", sorting" : "";
  told.textContent = `${facts.gaussians} Gaussians, ${place.x.toFixed(1)} east, ${place.y.toFixed(1)} north${sorting}, frame ${++frames}`;
});
