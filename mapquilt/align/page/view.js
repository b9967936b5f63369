// The canvas: all maps over one another, the classes of their walls, and what pointers and keys do to them.

import { about, apply, compose, inverse, matrix, shifted, times } from "./geometry.js";

const HANDLE = 30, REACH = 16;

export class View {
  // `page` holds maps, poses, selected, hidden, locked and walls; `on` is told of a selection, a move and its end.
  constructor(canvas, page, on) {
    Object.assign(this, { canvas, page, on, centre: [0, 0], zoom: 20, pointers: new Map(), drag: null, asked: 0 });
    // Painted in software: an upload of the whole picture is faster than thousands of small rectangles on a GPU, or on its emulation.
    this.context = canvas.getContext("2d", { alpha: false, willReadFrequently: true });
    new ResizeObserver(() => this.resize()).observe(canvas);
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => this.up(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      if (page.readOnly && document.activeElement !== canvas) return;  // the wheel scrolls the report
      event.preventDefault(); this.zoomAt(this.at(event), Math.exp(-event.deltaY / 500));
    }, { passive: false });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.ask());
  }

  resize() {
    const { canvas } = this, ratio = devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (!this.fitted && this.page.maps.length) this.fit(); else this.ask();
  }

  at(event) { const box = this.canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; }
  sheet([x, y]) { return [this.centre[0] + (x - this.canvas.clientWidth / 2) / this.zoom, this.centre[1] - (y - this.canvas.clientHeight / 2) / this.zoom]; }
  screen([x, y]) { return [this.canvas.clientWidth / 2 + (x - this.centre[0]) * this.zoom, this.canvas.clientHeight / 2 - (y - this.centre[1]) * this.zoom]; }
  ask() { if (!this.asked) this.asked = requestAnimationFrame(() => { this.asked = 0; this.paint(); }); }

  corners(index, pose = this.page.poses[index]) {
    const { rows, cols, resolution, frame } = this.page.maps[index], wide = cols * resolution, high = rows * resolution;
    return [[0, 0], [wide, 0], [wide, high], [0, high]].map((corner) => apply(pose, apply(frame, corner)));
  }

  middle(index) {
    const [a, , c] = this.corners(index);
    return [(a[0] + c[0]) / 2, (a[1] + c[1]) / 2];
  }

  fit() {
    const shown = this.page.maps.map((_, index) => index).filter((index) => !this.page.hidden.has(index));
    const points = shown.flatMap((index) => this.corners(index));
    if (!points.length || !this.canvas.clientWidth) return;
    const [xs, ys] = [0, 1].map((axis) => points.map((point) => point[axis]));
    const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    this.centre = [(left + right) / 2, (low + high) / 2];
    this.zoom = 0.86 * Math.min(this.canvas.clientWidth / (right - left || 1), this.canvas.clientHeight / (high - low || 1));
    this.fitted = true; this.ask();
  }

  zoomAt(point, factor) {
    const before = this.sheet(point);
    this.zoom = Math.min(20000, Math.max(0.01, this.zoom * factor));
    const after = this.sheet(point);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]]; this.ask();
  }

  handle(index) {
    const [, , c, d] = this.corners(index).map((corner) => this.screen(corner)), middle = this.screen(this.middle(index));
    const top = [(c[0] + d[0]) / 2, (c[1] + d[1]) / 2], away = [top[0] - middle[0], top[1] - middle[1]], length = Math.hypot(...away) || 1;
    return { top, knob: [top[0] + (away[0] / length) * HANDLE, top[1] + (away[1] / length) * HANDLE] };
  }

  // Return the map under a point: the selected one first, then the topmost.
  hit(point) {
    const { page } = this, { maps, poses, hidden, selected } = page;
    return [selected, ...maps.map((_, index) => index).reverse()].find((index) => {
      if (hidden.has(index) || page.fixed(index)) return false;
      const [x, y] = apply(inverse(compose(poses[index], maps[index].frame)), this.sheet(point)), { resolution, raster } = maps[index];
      return raster.known(Math.floor(y / resolution), Math.floor(x / resolution));
    });
  }

  down(event) {
    const point = this.at(event), { page } = this;
    this.canvas.focus(); this.canvas.setPointerCapture(event.pointerId); this.pointers.set(event.pointerId, point);
    if (this.pointers.size > 1) { this.finish(); return; }
    const movable = !page.hidden.has(page.selected) && !page.fixed(page.selected) && !page.busy;
    const onHandle = movable && Math.hypot(...this.handle(page.selected).knob.map((value, axis) => value - point[axis])) < REACH;
    const index = onHandle ? page.selected : event.button === 0 && !page.busy ? this.hit(point) : undefined;
    if (index === undefined) { this.drag = { kind: "pan" }; return; }
    if (index !== page.selected) this.on.select(index);
    this.drag = { kind: onHandle || event.shiftKey ? "turn" : "move", index, start: page.poses[index], from: this.sheet(point), middle: this.middle(index), moved: false };
  }

  move(event) {
    const point = this.at(event), last = this.pointers.get(event.pointerId);
    if (!last) { this.canvas.style.cursor = this.hit(point) === undefined ? "grab" : "move"; return; }
    if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1], apart = (a) => Math.hypot(a[0] - other[0], a[1] - other[1]) || 1;
      this.pan(point[0] - last[0], point[1] - last[1], 0.5); this.zoomAt(other, apart(point) / apart(last));
    } else if (this.drag?.kind === "pan") this.pan(point[0] - last[0], point[1] - last[1]);
    else if (this.drag) {
      const { kind, index, start, from, middle } = this.drag, now = this.sheet(point);
      const angle = ([x, y]) => Math.atan2(y - middle[1], x - middle[0]);
      const pose = kind === "turn" ? about(start, middle, angle(now) - angle(from)) : shifted(start, now[0] - from[0], now[1] - from[1]);
      this.drag.moved = true; this.on.move(index, pose);
    }
    this.pointers.set(event.pointerId, point);
  }

  up(event) { this.pointers.delete(event.pointerId); this.finish(); }

  finish() {
    const drag = this.drag;
    this.drag = null;
    if (drag?.moved) this.on.moved(drag.index);
  }

  pan(dx, dy, share = 1) { this.centre = [this.centre[0] - (share * dx) / this.zoom, this.centre[1] + (share * dy) / this.zoom]; this.ask(); }

  paint() {
    const { context, canvas, page, zoom, centre } = this, ratio = canvas.width / (canvas.clientWidth || 1);
    const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(name).trim(), dark = colour("color-scheme") === "dark";
    const began = performance.now(), z = zoom * ratio;
    const sheet = [z, 0, 0, -z, canvas.width / 2 - z * centre[0], canvas.height / 2 + z * centre[1]];
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = colour("--sheet"); context.fillRect(0, 0, canvas.width, canvas.height);
    context.imageSmoothingEnabled = false;
    const order = page.maps.map((_, index) => index).filter((index) => !page.hidden.has(index)).sort((a, b) => (a === page.selected) - (b === page.selected));
    for (const index of order) {
      const map = page.maps[index], pose = page.poses[index];
      const { picture, width } = map.raster.picture(z * pose.scale * map.resolution, tint(map.colour, dark));
      const cell = map.resolution * width, place = compose(compose(pose, map.frame), { x: 0, y: 0, yaw: 0, scale: cell });
      context.setTransform(...times(sheet, matrix(place)));
      context.drawImage(picture, 0, 0);
    }
    if (page.coloured) for (const index of order) this.paintWalls(index, sheet, z, { 1: colour("--match"), 2: colour("--contradiction") });
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    if (order.includes(page.selected)) this.paintFrame(page.selected, colour("--accent"), colour("--card"));
    this.on.painted(performance.now() - began);
  }

  paintWalls(index, sheet, z, colours) {
    const { context, page } = this, map = page.maps[index], classes = page.walls.get(index), pose = page.poses[index];
    if (!classes) return;
    context.setTransform(...times(sheet, matrix(pose)));
    const size = Math.max(map.resolution, 2.2 / (z * pose.scale)), half = size / 2, { points } = map;
    for (const kind of [1, 2]) {
      context.fillStyle = colours[kind];
      for (let k = 0; k < classes.length; k++) if (classes[k] === kind) context.fillRect(points[2 * k] - half, points[2 * k + 1] - half, size, size);
    }
  }

  paintFrame(index, accent, paper) {
    const { context, page } = this, corners = this.corners(index).map((corner) => this.screen(corner));
    context.strokeStyle = accent; context.lineWidth = 1.25; context.setLineDash([5, 4]);
    context.beginPath(); corners.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y))); context.closePath(); context.stroke();
    context.setLineDash([]);
    if (page.fixed(index)) return;
    const { top, knob } = this.handle(index);
    context.beginPath(); context.moveTo(...top); context.lineTo(...knob); context.stroke();
    context.beginPath(); context.arc(...knob, 7, 0, 2 * Math.PI); context.fillStyle = paper; context.fill(); context.lineWidth = 2; context.stroke();
  }
}

// A colour as numbers; lighter on a dark sheet.
export const tint = (hex, dark) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)).map((part) => (dark ? Math.round(part + 0.3 * (255 - part)) : part));
