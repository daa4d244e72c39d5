// What the page shows now. One object; who changes it asks for a redraw.

import { Cache, getFloats, getImage } from "./server.js";
import { PointGrid } from "./grid.js";

export const find = (id) => document.getElementById(id);

export const state = {
  info: null,       // what the server describes
  grid: null,       // of the result
  frame: 0,
  field: null, part: "value", under: "reference", opacity: 0.75,
  limits: new Map(),  // by name of a field; in its unit
  tool: "look",
  marks: [], chosen: null,
  roi: [], corners: [],  // polygons, and the corners of the one that is drawn
  preview: null,
  shown: null,      // { image, values, status, motion } of the frame
  pointer: null,    // place of the reference under the pointer
};

const fields = new Cache(120), images = new Cache(16);

export const result = () => state.info?.result ?? null;
export const frames = () => (result() ? result().frames : (state.info?.images ?? []).map((name) => ({ name, error: "" })));
export const fieldNow = () => result()?.fields.find(({ name }) => name === state.field) ?? null;
export const drawnNow = () => (state.part === "sigma" && fieldNow()?.sigma) || fieldNow();

export function forget() {
  fields.clear();
  for (const name of [...state.limits.keys()]) if (name !== "preview") state.limits.delete(name);
  state.grid = result() ? new PointGrid(result()) : null;
}

const values = (name, frame) => fields.get(`${name}/${frame}`, () => getFloats("field", { name, frame }));

export const reference = () => images.get(" reference", () => getImage(null));
export const imageOf = (name) => images.get(name, () => getImage(name));

// Image and fields of the frame that is chosen.
export async function read() {
  const { frame, under } = state, known = result(), { name } = frames()[frame];
  if (!known) return { image: await imageOf(name) };
  const moving = under === "frame";
  const [image, drawn, sigma, status, u, v] = await Promise.all([
    moving ? imageOf(name) : reference(),
    values(fieldNow().name, frame),
    fieldNow().sigma ? values(fieldNow().sigma.name, frame) : null,
    values("status", frame),
    ...(moving ? ["u", "v"].map((one) => values(one, frame)) : []),
  ]);
  return { image, value: drawn, sigma, status, motion: moving ? { u, v } : null };
}

// The image of the reference that a correlation shall begin from.
export const beforeName = () => find("reference").value;
