// splats.ply by PlayCanvas: the eye is the origin, z is up.
import * as pc from "playcanvas";

export async function open({ width, height, fov }) {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width, height });
  document.body.append(canvas);
  const app = new pc.Application(canvas, {
    graphicsDeviceOptions: { antialias: false, preserveDrawingBuffer: true, alpha: false },
  });
  app.setCanvasFillMode(pc.FILLMODE_NONE, width, height);
  app.setCanvasResolution(pc.RESOLUTION_FIXED, width, height);
  app.autoRender = false;
  const asset = new pc.Asset("splats", "gsplat", { url: "splats.ply" });
  app.assets.add(asset);
  await new Promise((done, failed) => {
    asset.ready(done);
    asset.on("error", failed);
    app.assets.load(asset);
  });
  const splats = new pc.Entity("splats"), eye = new pc.Entity("eye");
  splats.addComponent("gsplat", { asset });
  eye.addComponent("camera", { fov, nearClip: 0.001, farClip: 1e4, clearColor: new pc.Color(0, 0, 0, 1) });
  eye.camera.toneMapping = pc.TONEMAP_NONE;
  eye.camera.gammaCorrection = pc.GAMMA_SRGB;
  app.root.addChild(splats);
  app.root.addChild(eye);
  app.start();
  return {
    gl: app.graphicsDevice.gl,
    draw(ahead) {
      eye.lookAt(new pc.Vec3(...ahead), new pc.Vec3(0, 0, 1));
      app.renderNextFrame = true;
      app.tick(performance.now());
    },
  };
}
