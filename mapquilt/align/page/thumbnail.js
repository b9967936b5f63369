// A small picture of two maps at a candidate: their cells, and the classes of their walls.

import { apply, compose, matrix, times } from "./geometry.js";
import { tint } from "./view.js";

export const thumbnail = (page, poses, walls, width, height) => {
  const ratio = devicePixelRatio || 1, canvas = document.createElement("canvas"), style = getComputedStyle(document.documentElement);
  canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d"), colour = (name) => style.getPropertyValue(name).trim(), dark = colour("color-scheme") === "dark";
  const bounds = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [index, pose] of poses) {
    const { points } = page.maps[index];
    for (let k = 0; k < points.length; k += 2) {
      const [x, y] = apply(pose, [points[k], points[k + 1]]);
      bounds[0] = Math.min(bounds[0], x); bounds[1] = Math.min(bounds[1], y); bounds[2] = Math.max(bounds[2], x); bounds[3] = Math.max(bounds[3], y);
    }
  }
  const z = 0.92 * Math.min(canvas.width / (bounds[2] - bounds[0] || 1), canvas.height / (bounds[3] - bounds[1] || 1));
  const sheet = [z, 0, 0, -z, canvas.width / 2 - (z * (bounds[0] + bounds[2])) / 2, canvas.height / 2 + (z * (bounds[1] + bounds[3])) / 2];
  context.imageSmoothingEnabled = false;
  for (const [index, pose] of poses) {
    const map = page.maps[index], { picture, width: cells } = map.raster.picture(z * pose.scale * map.resolution, tint(map.colour, dark));
    context.setTransform(...times(sheet, matrix(compose(compose(pose, map.frame), { x: 0, y: 0, yaw: 0, scale: map.resolution * cells }))));
    context.drawImage(picture, 0, 0);
  }
  for (const kind of [1, 2]) for (const [index, pose] of poses) {
    const { points } = page.maps[index], classes = walls.get(index), size = (1.4 * ratio) / (z * pose.scale);
    context.setTransform(...times(sheet, matrix(pose)));
    context.fillStyle = colour(kind === 1 ? "--match" : "--contradiction");
    for (let k = 0; k < classes.length; k++) if (classes[k] === kind) context.fillRect(points[2 * k] - size / 2, points[2 * k + 1] - size / 2, size, size);
  }
  return canvas;
};
