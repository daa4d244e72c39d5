// A quantity over time: a dot and its two-sigma bar for each touch of each frame, or the strain at
// the pinned point. Dots, not lines, because a touch that leaves and one that comes are never joined
// by a line that nobody measured.

import { roundUp } from "./colour.js";

const SECONDS = 15;
const LEFT = 44, RIGHT = 6, TOP = 8, BOTTOM = 18;  // px round the dots
const MICRO = 1e6;

// What each choice shows of a frame's marks, and its unit: place and force from 0 up, strain about 0.
const QUANTITIES = {
  force: { unit: "N", of: (mark) => [mark.force, mark.sigma_force ?? 0] },
  x: { unit: "mm", of: (mark) => [mark.x, spread(mark)[0]] },
  y: { unit: "mm", of: (mark) => [mark.y, spread(mark)[1]] },
  strain: { unit: "µε" },
};

function spread(mark) {  // standard deviations of a place along x and y
  const [a, b, angle] = mark.sigma.map((part) => part ?? 0), c = Math.cos(angle), s = Math.sin(angle);
  return [Math.hypot(a * c, b * s), Math.hypot(a * s, b * c)];
}

export class Chart {
  constructor(canvas) {
    this.canvas = canvas;
    this.history = [];
    this.quantity = "force";
  }

  get unit() { return QUANTITIES[this.quantity].unit; }

  // strain: [value, sigma] of the chosen component at the pinned point, or null
  add(frame, strain) {
    const last = this.history.at(-1);
    const { captured: time, touches, truth, plate } = frame;
    if (time === last?.time) return;  // the last frame stands for one that has not come
    if (time < last?.time) this.history = [];  // the loop was started anew
    this.history.push({ time, touches, truth: truth ?? [], plate, strain });
    while (this.history[0].time < time - SECONDS) this.history.shift();
  }

  forgetStrain() {  // another point or component is another curve
    for (const entry of this.history) entry.strain = null;
  }

  // [time, value, sigma] of all dots, those of the truth apart
  dots() {
    const { of } = QUANTITIES[this.quantity];
    const each = (name) => this.history.flatMap((entry) => entry[name].map((mark) => [entry.time, ...of(mark)]));
    if (of) return { found: each("touches"), truth: each("truth") };
    const there = this.history.filter(({ strain }) => strain);
    return { found: there.map(({ time, strain: [value, sigma] }) => [time, MICRO * value, MICRO * sigma]), truth: [] };
  }

  range({ found, truth }) {
    const { plate } = this.history.at(-1);
    if (this.quantity === "x") return [0, plate[0]];
    if (this.quantity === "y") return [0, plate[1]];
    const top = roundUp(Math.max(1, ...[...found, ...truth].map(([, value]) => Math.abs(value))));
    return this.quantity === "strain" ? [-top, top] : [0, top];
  }

  draw() {
    if (!this.history.length) return;
    const { canvas } = this, scale = window.devicePixelRatio || 1;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    Object.assign(canvas, { width: wide * scale, height: high * scale });
    const context = canvas.getContext("2d");
    context.scale(scale, scale);
    const style = getComputedStyle(document.documentElement);
    const ink = (name) => style.getPropertyValue(`--${name}`);
    const dots = this.dots(), [low, top] = this.range(dots);
    const newest = this.history.at(-1).time;
    const x = (time) => wide - RIGHT - (newest - time) / SECONDS * (wide - LEFT - RIGHT);
    const y = (value) => high - BOTTOM - (Math.min(Math.max(value, low), top) - low) / (top - low) * (high - BOTTOM - TOP);
    this.drawAxes(context, x, y, [low, (low + top) / 2, top], newest, ink, wide);
    context.fillStyle = ink("muted");
    context.globalAlpha = 0.3;
    for (const [time, value] of dots.truth) context.fillRect(x(time) - 1, y(value) - 4, 2, 8);
    context.fillStyle = ink("pattern");
    for (const [time, value, sigma] of dots.found) {
      const [above, below] = [y(value + 2 * sigma), y(value - 2 * sigma)];
      context.globalAlpha = 0.25;
      context.fillRect(x(time) - 0.75, above, 1.5, below - above);
      context.globalAlpha = 1;
      context.fillRect(x(time) - 0.9, y(value) - 0.9, 1.8, 1.8);
    }
  }

  drawAxes(context, x, y, ticks, newest, ink, wide) {
    Object.assign(context, { font: "11px system-ui, sans-serif", strokeStyle: ink("line"), fillStyle: ink("muted"), lineWidth: 1 });
    context.textBaseline = "middle";
    context.textAlign = "right";
    for (const value of ticks) {
      context.beginPath();
      context.moveTo(LEFT - 6, Math.round(y(value)) + 0.5);
      context.lineTo(wide, Math.round(y(value)) + 0.5);
      context.stroke();
      context.fillText(String(+value.toPrecision(3)).replace("-", "−"), LEFT - 12, y(value));
    }
    context.textBaseline = "alphabetic";
    context.textAlign = "center";
    for (const back of [15, 10, 5]) context.fillText(`−${back} s`, Math.max(x(newest - back), LEFT + 12), y(ticks[0]) + 15);
    context.textAlign = "right";
    context.fillText("now", wide - 2, y(ticks[0]) + 15);
  }
}
