// terrain.glb as Gaussians, by WebGL: PlayCanvas reads KHR_gaussian_splatting.
import * as pc from "playcanvas";

const canvas = document.querySelector("canvas");
const device = await pc.createGraphicsDevice(canvas, { deviceTypes: ["webgl2"], antialias: false });
const options = new pc.AppOptions();
Object.assign(options, {
  graphicsDevice: device,
  componentSystems: [pc.CameraComponentSystem, pc.RenderComponentSystem, pc.GSplatComponentSystem],
  resourceHandlers: [pc.ContainerHandler, pc.GSplatHandler, pc.TextureHandler],
});
const app = new pc.AppBase(canvas);
app.init(options);
app.setCanvasResolution(pc.RESOLUTION_AUTO);
app.start();

const side = (await (await fetch("/exports/terrain/terrain.json")).json()).tile_side;
const asset = new pc.Asset("terrain", "container", { url: "/exports/terrain/terrain.glb" });
await new Promise((resolve, reject) => {
  asset.once("load", resolve);
  asset.once("error", (message) => reject(new Error(message)));
  app.assets.add(asset);
  app.assets.load(asset);
});
app.root.addChild(asset.resource.instantiateRenderEntity());

const camera = new pc.Entity("camera");
camera.addComponent("camera", {
  clearColor: new pc.Color(0xb8 / 255, 0xcb / 255, 0xdc / 255), fov: 45, nearClip: 0.01 * side, farClip: 100 * side,
  toneMapping: pc.TONEMAP_NONE, gammaCorrection: pc.GAMMA_SRGB,
});
camera.setPosition(-1.1 * side, 0.8 * side, 1.7 * side);
camera.lookAt(0.2 * side, 0, -0.2 * side);
app.root.addChild(camera);
