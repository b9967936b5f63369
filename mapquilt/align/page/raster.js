// The cells of a map at all sizes: each level joins four cells of the one before, and a wall wins, so that none vanishes.

const FLOOR_OPACITY = 46;

export class Raster {
  constructor(cells, rows, cols) {
    this.levels = [{ cells, rows, cols }];
    while (Math.max(this.levels.at(-1).rows, this.levels.at(-1).cols) > 64) this.levels.push(coarser(this.levels.at(-1)));
    this.pictures = new Map();
  }

  known(row, col) {
    const { cells, rows, cols } = this.levels[0];
    return row >= 0 && col >= 0 && row < rows && col < cols && cells[row * cols + col] > 0;
  }

  // Choose the finest level whose cells are at least a pixel wide, and draw it once in each colour.
  picture(pixelsPerCell, [red, green, blue]) {
    const wanted = Math.max(0, Math.ceil(-Math.log2(pixelsPerCell)));
    const level = Math.min(wanted, this.levels.length - 1), key = `${level} ${red} ${green} ${blue}`;
    if (!this.pictures.has(key)) this.pictures.set(key, painted(this.levels[level], red, green, blue));
    return { picture: this.pictures.get(key), width: 2 ** level };
  }
}

const coarser = ({ cells, rows, cols }) => {
  const high = Math.ceil(rows / 2), wide = Math.ceil(cols / 2), out = new Uint8Array(high * wide);
  for (let row = 0; row < rows; row++) {
    const from = row * cols, to = (row >> 1) * wide;
    for (let col = 0; col < cols; col++) {
      const cell = cells[from + col], at = to + (col >> 1);
      if (cell > out[at]) out[at] = cell;
    }
  }
  return { cells: out, rows: high, cols: wide };
};

// The lowest row is the first row of the picture, which is drawn with y up.
const painted = ({ cells, rows, cols }, red, green, blue) => {
  const canvas = document.createElement("canvas");
  canvas.width = cols; canvas.height = rows;
  const context = canvas.getContext("2d", { willReadFrequently: true }), image = context.createImageData(cols, rows);
  const colours = new Uint32Array(image.data.buffer), rgb = (blue << 16) | (green << 8) | red;
  const floor = ((FLOOR_OPACITY << 24) | rgb) >>> 0, wall = ((255 << 24) | rgb) >>> 0;
  for (let k = 0; k < cells.length; k++) if (cells[k]) colours[k] = cells[k] === 2 ? wall : floor;
  context.putImageData(image, 0, 0);
  return canvas;
};
