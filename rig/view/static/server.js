// What the page asks the server for. A refusal is one sentence, which is shown and not thrown away.

export class Refusal extends Error {}

async function checked(response) {
  if (response.ok) return response;
  throw new Refusal((await response.text()).trim());
}

async function reached(path, options) {
  try {
    return await checked(await fetch(path, options));
  } catch (error) {
    if (error instanceof Refusal) throw error;
    throw new Refusal("the program behind this page has ended; start touchplate view again");
  }
}

const query = (path, values) => `${path}?${new URLSearchParams(values)}`;

export const getJSON = async (path, values = {}) => (await reached(query(path, values))).json();
export const post = async (path, body) => (await reached(path, { method: "POST", body: JSON.stringify(body) })).json();
export const postFor = async (path, body) => reached(path, { method: "POST", body: JSON.stringify(body) });

export async function getFloats(path, values) {
  return new Float32Array(await (await reached(query(path, values))).arrayBuffer());
}

// An image and its true size: a very large one comes smaller than it is.
export async function getImage(name) {
  const response = await reached(query("image", name === null ? {} : { name }));
  const size = response.headers.get("x-size").split(",").map(Number);
  return { bitmap: await createImageBitmap(await response.blob()), size };
}

export async function save(path, values) {
  const response = await reached(query(path, values));
  keep(await response.blob(), response.headers.get("content-disposition").match(/"(.*)"/)[1]);
}

export function keep(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

// The last things asked for, so that playing forth and back asks once.
export class Cache {
  constructor(room) { this.room = room; this.kept = new Map(); }

  get(key, ask) {
    let found = this.kept.get(key);
    if (found) this.kept.delete(key);
    else {
      found = ask();
      found.catch(() => this.kept.delete(key));
    }
    this.kept.set(key, found);
    if (this.kept.size > this.room) this.kept.delete(this.kept.keys().next().value);
    return found;
  }

  clear() { this.kept.clear(); }
}
