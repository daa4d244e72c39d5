// Force over time: a dot and its two-sigma bar for each touch of each frame. Dots, not lines,
// because a touch that leaves and one that comes are never joined by a line that nobody measured.

import { roundUp } from "./colour.js";

const SECONDS = 15;

export class Chart {
  constructor(canvas) {
    this.canvas = canvas;
    this.history = [];
  }

  add(frame) {
    const last = this.history.at(-1);
    if (last && frame.captured < last.time) this.history = [];  // the loop was started anew
    this.history.push({ time: frame.captured, touches: frame.touches, truth: frame.truth ?? [] });
    while (this.history[0].time < frame.captured - SECONDS) this.history.shift();
  }

  draw() {
    if (!this.history.length) return;
    const { canvas } = this, dots = window.devicePixelRatio || 1;
    const [wide, high] = [canvas.clientWidth, canvas.clientHeight];
    Object.assign(canvas, { width: wide * dots, height: high * dots });
    const context = canvas.getContext("2d");
    context.scale(dots, dots);
    const style = getComputedStyle(document.documentElement);
    const ink = (name) => style.getPropertyValue(`--${name}`);
    const top = roundUp(Math.max(1, ...this.history.flatMap(({ touches, truth }) => [...touches, ...truth].map((mark) => mark.force))));
    const newest = this.history.at(-1).time;
    const x = (time) => wide - 6 - (newest - time) / SECONDS * (wide - 30);
    const y = (force) => high - 18 - Math.max(force, 0) / top * (high - 26);
    this.drawAxes(context, x, y, top, newest, ink, wide);
    context.fillStyle = ink("muted");
    context.globalAlpha = 0.3;
    for (const { time, truth } of this.history) {
      for (const mark of truth) context.fillRect(x(time) - 1, y(mark.force) - 4, 2, 8);
    }
    context.globalAlpha = 1;
    context.fillStyle = ink("pattern");
    for (const { time, touches } of this.history) {
      for (const mark of touches) {
        const spread = 2 * (mark.sigma_force ?? 0), [high, low] = [y(mark.force + spread), y(mark.force - spread)];
        context.globalAlpha = 0.25;
        context.fillRect(x(time) - 0.75, high, 1.5, low - high);
        context.globalAlpha = 1;
        context.fillRect(x(time) - 0.9, y(mark.force) - 0.9, 1.8, 1.8);
      }
    }
  }

  drawAxes(context, x, y, top, newest, ink, wide) {
    Object.assign(context, { font: "11px system-ui, sans-serif", strokeStyle: ink("line"), fillStyle: ink("muted"), lineWidth: 1 });
    context.textBaseline = "middle";
    context.textAlign = "right";
    for (const force of [0, top / 2, top]) {
      context.beginPath();
      context.moveTo(24, Math.round(y(force)) + 0.5);
      context.lineTo(wide, Math.round(y(force)) + 0.5);
      context.stroke();
      context.fillText(String(+force.toPrecision(3)), 18, y(force));
    }
    context.textBaseline = "alphabetic";
    context.textAlign = "center";
    for (const back of [15, 10, 5]) context.fillText(`−${back} s`, Math.max(x(newest - back), 36), y(0) + 15);
    context.textAlign = "right";
    context.fillText("now", wide - 2, y(0) + 15);
  }
}
