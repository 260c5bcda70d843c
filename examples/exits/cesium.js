// terrain_3dtiles, compressed by SPZ, in CesiumJS. A tileset without a place on the globe is put at 0 N, 0 E.
/* global Cesium */
const { CesiumWidget, Cesium3DTileset, Cartesian3, Color, Matrix4, Transforms } = Cesium;

const widget = new CesiumWidget(document.querySelector("#view"), {
  globe: false, skyBox: false, skyAtmosphere: false, baseLayer: false, msaaSamples: 1,
});
const { scene } = widget;
scene.backgroundColor = Color.fromBytes(0xb8, 0xcb, 0xdc);
[scene.sun, scene.moon, scene.fog].forEach((part) => { if (part) Object.assign(part, { show: false, enabled: false }); });

const tileset = await Cesium3DTileset.fromUrl("/exports/terrain/terrain_3dtiles/tileset.json");
const place = tileset.root.transform, isPlaced = !Matrix4.equals(place, Matrix4.IDENTITY);
const frame = isPlaced ? place : Transforms.eastNorthUpToFixedFrame(Cartesian3.fromDegrees(0, 0));
if (!isPlaced) tileset.modelMatrix = frame;
scene.primitives.add(tileset);

const side = (await (await fetch("/exports/terrain/terrain.json")).json()).tile_side;
const at = (east, north, up) => Matrix4.multiplyByPoint(frame, new Cartesian3(east * side, north * side, up * side), new Cartesian3());
const eye = at(-1.1, -1.7, 0.8), target = at(0.2, 0.2, 0);
const direction = Cartesian3.normalize(Cartesian3.subtract(target, eye, new Cartesian3()), new Cartesian3());
const up = Cartesian3.normalize(Cartesian3.subtract(at(0, 0, 1), at(0, 0, 0), new Cartesian3()), new Cartesian3());
const right = Cartesian3.normalize(Cartesian3.cross(direction, up, new Cartesian3()), new Cartesian3());
scene.camera.frustum.fov = 2 * Math.atan(Math.tan(Math.PI / 8) * Math.max(1, innerWidth / innerHeight)); // of the wider side
scene.camera.frustum.near = 0.01 * side;
scene.camera.setView({ destination: eye, orientation: { direction, up: Cartesian3.cross(right, direction, new Cartesian3()) } });
