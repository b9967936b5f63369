// Similarities p' = scale R(yaw) p + (x, y), and affine matrices [a, b, c, d, e, f] of a canvas.

export const compose = (s, t) => {
  const [x, y] = apply(s, [t.x, t.y]);
  return { x, y, yaw: wrap(s.yaw + t.yaw), scale: s.scale * t.scale };
};

export const apply = (s, [x, y]) => {
  const c = s.scale * Math.cos(s.yaw), d = s.scale * Math.sin(s.yaw);
  return [s.x + c * x - d * y, s.y + d * x + c * y];
};

export const inverse = (s) => {
  const c = Math.cos(s.yaw) / s.scale, d = Math.sin(s.yaw) / s.scale;
  return { x: -c * s.x - d * s.y, y: d * s.x - c * s.y, yaw: -s.yaw, scale: 1 / s.scale };
};

export const shifted = (s, dx, dy) => ({ ...s, x: s.x + dx, y: s.y + dy });

// Turn and scale a pose about a point of the sheet.
export const about = (s, [px, py], yaw, scale = 1) => {
  const c = scale * Math.cos(yaw), d = scale * Math.sin(yaw), x = s.x - px, y = s.y - py;
  return { x: px + c * x - d * y, y: py + d * x + c * y, yaw: wrap(s.yaw + yaw), scale: s.scale * scale };
};

export const wrap = (angle) => angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));

export const matrix = (s) => {
  const c = s.scale * Math.cos(s.yaw), d = s.scale * Math.sin(s.yaw);
  return [c, d, -d, c, s.x, s.y];
};

export const times = (m, n) => [
  m[0] * n[0] + m[2] * n[1], m[1] * n[0] + m[3] * n[1],
  m[0] * n[2] + m[2] * n[3], m[1] * n[2] + m[3] * n[3],
  m[0] * n[4] + m[2] * n[5] + m[4], m[1] * n[4] + m[3] * n[5] + m[5],
];
