// What the pointer does on the image: it moves it, sets marks, draws the ROI, and takes hold of ends.

import { moved, movedBack } from "./grid.js";
import { addMark, followMark, readMarks, rectangle, showMarks } from "./marks.js";
import { askPreview } from "./setup.js";
import { find, result, state } from "./state.js";

const WHEEL = 1.0015, SHORTEST = 2;  // zoom a unit of the wheel; px below which a drag is none

export function watchPointer(drawing, redraw) {
  const { canvas } = drawing;
  let held = null;

  const motion = () => state.shown?.motion ?? null;
  const shownAt = (place) => moved(state.grid, motion(), place);
  const under = (event) => movedBack(state.grid, motion(), drawing.toImage(event));
  const inside = ([x, y]) => x >= -0.5 && y >= -0.5 && x < drawing.size[0] - 0.5 && y < drawing.size[1] - 0.5;
  const clamped = (place) => place.map((at, i) => Math.min(Math.max(at, 0), drawing.size[i] - 1));

  // What lies under the pointer and can be moved: gives what moves it to a place.
  function grabbed(event) {
    for (const mark of [...state.marks].reverse()) {
      for (const [i, end] of mark.ends.entries()) {
        if (!drawing.isNear(event, shownAt(end))) continue;
        const move = (place) => { if (mark.kind === "point") mark.ends = [place, place]; else mark.ends[i] = place; };
        return { mark, move };
      }
    }
    if (state.tool !== "roi" || state.corners.length) return null;
    for (const polygon of state.roi) {
      const i = polygon.points.findIndex((corner) => drawing.isNear(event, corner));
      if (i >= 0) return { move: (place) => { polygon.points[i] = place; }, done: askPreview };
    }
    return null;
  }

  function began(event) {
    const place = under(event);
    if (state.tool === "look") return { pan: true };
    if (!inside(place)) return null;
    if (state.tool === "roi") return corner(event, place);
    const mark = addMark(state.tool, endsOf(state.tool, place, place));
    mark.fresh = true;
    return { mark, move: (to) => { mark.ends = endsOf(mark.kind, place, to); } };
  }

  function endsOf(kind, from, to) {
    if (kind === "gauge") return rectangle(from, to);
    return kind === "point" ? [to, [...to]] : [from, [...to]];
  }

  function corner(event, place) {
    if (state.corners.length > 2 && drawing.isNear(event, state.corners[0])) closeRegion();
    else state.corners.push(place);
    return null;
  }

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button > 1) return;
    held = event.button === 1 ? { pan: true } : grabbed(event) ?? began(event);
    if (held?.mark) state.chosen = held.mark;
    if (held) canvas.setPointerCapture(event.pointerId);
    redraw();
  });
  canvas.addEventListener("pointermove", (event) => {
    state.pointer = under(event);
    if (held?.pan) drawing.pan(event.movementX, event.movementY);
    if (held?.move) {
      held.move(clamped(state.pointer));
      if (held.mark) {
        held.mark.now = null;
        followMark(held.mark).then(redraw);
      }
    }
    redraw();
  });
  const release = () => {
    const { mark, done } = held ?? {};
    held = null;
    if (mark) {
      const start = mark.ends[0], end = mark.ends[mark.kind === "gauge" ? 2 : 1], length = Math.hypot(end[0] - start[0], end[1] - start[1]);
      if (mark.fresh && mark.kind !== "point" && length < SHORTEST) state.marks = state.marks.filter((one) => one !== mark);
      mark.fresh = false;
      mark.now = null;
      showMarks();
      if (result()) readMarks((one) => one === mark).then(redraw);
    }
    done?.();
    redraw();
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointerleave", () => { if (!held) state.pointer = null; redraw(); });
  canvas.addEventListener("dblclick", () => {
    if (state.tool !== "roi" || state.corners.length < 3) return;
    const [last, before] = [state.corners.at(-1), state.corners.at(-2)];
    if (Math.hypot(last[0] - before[0], last[1] - before[1]) < SHORTEST) state.corners.pop();
    closeRegion();
    redraw();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    drawing.zoomAbout(drawing.toImage(event), WHEEL ** -event.deltaY);
    redraw();
  }, { passive: false });
}

export function closeRegion() {
  if (state.corners.length < 3) return;
  const points = state.corners.map((place) => place.map((at) => +at.toFixed(1)));
  state.roi.push({ points, hole: find("hole").checked });
  state.corners = [];
  askPreview();
}
