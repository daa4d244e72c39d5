// Points on a grid, their values, and the places that they have moved to.

export class PointGrid {
  constructor({ x, y, step }) {
    Object.assign(this, { x, y, step, rows: y.length, columns: x.length });
  }

  // Number of the point nearest to a place of the reference, or -1 beyond the grid.
  nearest([x, y]) {
    const column = Math.round((x - this.x[0]) / this.step), row = Math.round((y - this.y[0]) / this.step);
    const inside = column >= 0 && row >= 0 && column < this.columns && row < this.rows;
    return inside ? row * this.columns + column : -1;
  }

  place(number) { return [this.x[number % this.columns], this.y[Math.floor(number / this.columns)]]; }
}

// Where the frame shows what the reference shows at a place; there itself where it was lost, and
// without a motion, as before a correlation, when there is no grid either.
export function moved(grid, motion, place) {
  if (!motion) return place;
  const number = grid.nearest(place);
  if (number < 0 || Number.isNaN(motion.u[number])) return place;
  return [place[0] + motion.u[number], place[1] + motion.v[number]];
}

export function movedBack(grid, motion, place) {
  let found = place;
  for (let i = 0; i < 4; i++) {
    const [x, y] = moved(grid, motion, found);
    found = [found[0] + place[0] - x, found[1] + place[1] - y];
  }
  return found;
}

// Displacement of the corners of all cells, the mean of the points about each that were measured.
export function corners(grid, motion) {
  const { rows, columns } = grid, wide = columns + 1;
  const sums = [0, 1, 2].map(() => new Float32Array(wide * (rows + 1)));
  for (let n = 0; n < rows * columns; n++) {
    if (Number.isNaN(motion.u[n])) continue;
    const first = Math.floor(n / columns) * wide + n % columns;
    for (const at of [first, first + 1, first + wide, first + wide + 1]) {
      sums[0][at] += motion.u[n];
      sums[1][at] += motion.v[n];
      sums[2][at] += 1;
    }
  }
  return [sums[0].map((sum, i) => sum / sums[2][i]), sums[1].map((sum, i) => sum / sums[2][i])];
}
