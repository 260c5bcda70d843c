/**
 * The endless terrain in other pages; docs/terrain-api.md says more. Lengths are in the terrain's unit; x east, y north,
 * z up; angles in degrees.
 */

/** A point or a direction: x, y, z. */
export type Vector = [number, number, number];

/** An eye: yaw from east, counter-clockwise; pitch above the horizon; eye: height above the surface. */
export interface Place {
  x: number;
  y: number;
  eye: number;
  yaw: number;
  pitch: number;
  /** Of the picture's longer side; default: 60. */
  fieldOfView?: number;
}

/** Position and axes of length 1; width, height and focal length in pixels. */
export interface Camera {
  eye: number[];
  right: number[];
  up: number[];
  ahead: number[];
  width: number;
  height: number;
  focal: number;
}

/** A cell of the tile grid, from (i, j) * tileSide to (i + 1, j + 1) * tileSide, and the tile in it. */
export interface Cell {
  i: number;
  j: number;
  tile: number;
}

/** A cell that is drawn: its levels of detail, 0 the finest, and its order, an index of `directions`; null: by depth. */
export interface DrawnCell extends Cell {
  finest: number;
  coarsest: number;
  order: number | null;
}

/** What is drawn of a camera's view. */
export interface Update {
  /** Back to front. */
  cells: DrawnCell[];
  gaussians: number;
  /** Distance from the eye at which tiles end. */
  reach: number;
  /** Distance at which level l gives way to l + 1, and half the width of that fade. */
  switches: number[];
  bands: number[];
  /** False: tiles or shadows are still being made; another update shows more. */
  complete: boolean;
}

/** Where a ray meets the ground. */
export interface Hit extends Cell {
  point: Vector;
  normal: Vector;
  distance: number;
}

/** Gaussians of a tile at a level, from its south-western corner on the surface; of an object, from its foot. */
export interface Gaussians {
  count: number;
  centres: Float32Array;
  /** Standard deviations along the axes. */
  deviations: Float32Array;
  /** Quaternions w, x, y, z. */
  turns: Float32Array;
  /** Red, green, blue (sRGB) and opacity, 0 to 1. */
  colours: Float32Array;
}

/** Indices of a tile's Gaussians, back to front for whoever looks in a direction. */
export interface Order {
  /** Index of `directions`. */
  number: number;
  direction: number[];
  indices: Uint32Array;
}

/** A position of the sun. */
export interface Sun {
  /** Solar time. */
  hour: number;
  elevation: number;
  /** Clockwise from north. */
  azimuth: number;
  direction: Vector;
}

/** Draws the last update on a WebGL2 context. */
export interface Painter {
  /**
   * backdrop: sky and far ground first (default); overlay: "picture" (default) or another name of the page's menu;
   * seconds: time of the wind; default: still air.
   */
  draw(camera: Camera, options?: { backdrop?: boolean; overlay?: string; seconds?: number }): void;
  /** Free its textures. */
  end(): void;
}

export interface Progress {
  bytes: number;
  total: number;
  parts: number;
  of: number;
}

export interface Terrain {
  /** "metre" where the scale is known. */
  unit: string;
  tileSide: number;
  /** Height above the surface below which no photo looked. */
  eyeFloor: number;
  /** Mean height of the ground of the tiles above the surface. */
  lift: number;
  levels: number;
  tiles: number;
  directions: number[][];
  materials: string[];
  /** Object k is number `tiles` + k for `gaussians` and `orders`. */
  objects: string[];
  /** Height of each object's foot above the surface. */
  feet: number[];
  /** Resolves when all parts of the bundle are read; tiles are composed of them when a view needs them. */
  loaded: Promise<void>;
  height(x: number, y: number): number;
  normal(x: number, y: number): Vector;
  variation(x: number, y: number, material?: number): Vector;
  cellAt(x: number, y: number): Cell;
  pick(origin: ArrayLike<number>, direction: ArrayLike<number>, farthest?: number): Hit | null;
  /** The sun that lights what painters draw; null: colours are as photographed. */
  readonly sun: Sun | null;
  /** Hour of the day, null for the sun of the photos, or "off". Shadows follow with updates. */
  setSun(hour: number | null | "off"): void;
  camera(place: Place, width: number, height: number): Camera;
  /** Rejects with a TerrainError once the terrain was ended. */
  update(camera: Camera, options?: { budget?: number; exact?: boolean }): Promise<Update>;
  gaussians(tile: number, level: number): Promise<Gaussians>;
  orders(tile: number, level: number): Promise<Order[]>;
  createPainter(gl: WebGL2RenderingContext): Painter;
  end(): void;
}

export interface LoadOptions {
  onProgress?: (progress: Progress) => void;
  /** Errors that no promise carries; default: console.error. */
  onError?: (error: Error) => void;
}

/** Open a terrain: the address of a page folder or of a bundle, its zip, or its files. */
export function load(where: string | URL | Blob | Iterable<File>, options?: LoadOptions): Promise<Terrain>;

/** The direction through a point of the picture; across from the left, down from the top, 0 to 1. */
export function rayThrough(camera: Camera, across: number, down: number): number[];

/** A terrain that cannot be read; its message is for people. */
export class TerrainError extends Error {}
