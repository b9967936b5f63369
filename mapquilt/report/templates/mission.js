"use strict";
// The mission in 3-D by plain WebGL: walls, robots, their scans as they turn, and all that they have seen so far.
(() => {
  const source = document.getElementById("mission-data");
  if (!source) return;
  const scene = JSON.parse(source.textContent);
  const $ = (selector) => document.querySelector(selector);
  const canvas = $("#mission-canvas"), slider = $("#moment"), clock = $("#clock"), play = $("#play"), speed = $("#speed");
  const gl = canvas.getContext("webgl", { antialias: true, alpha: false });
  if (!gl) {
    $("#no-webgl").hidden = false;
    canvas.parentElement.hidden = true;
    $("#mission-controls").hidden = true;
    return;
  }

  const WALL = 1.1, PLANE = 0.3, FOV = 0.6;  // height of walls and of the plane of the scans [m], field of view [rad]
  const times = scene.times, end = times[times.length - 1], [width, height] = scene.size;

  // One program draws it all: flat shades, or with `soft` a fading alpha; `pose` moves robots.
  const shader = (type, text) => { const made = gl.createShader(type); gl.shaderSource(made, text); gl.compileShader(made); return made; };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `
    attribute vec3 position; attribute float shade; uniform mat4 view; uniform vec4 pose; uniform float size; varying float tone;
    void main() {
      vec2 place = vec2(pose.z * position.x - pose.w * position.y, pose.w * position.x + pose.z * position.y) + pose.xy;
      gl_Position = view * vec4(place, position.z, 1.0); gl_PointSize = size; tone = shade;
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
    precision mediump float; uniform vec4 colour; uniform float soft; varying float tone;
    void main() { gl_FragColor = soft > 0.5 ? vec4(colour.rgb, colour.a * tone) : vec4(colour.rgb * tone, colour.a); }`));
  gl.linkProgram(program); gl.useProgram(program);
  const at = Object.fromEntries(["view", "pose", "size", "colour", "soft"].map((name) => [name, gl.getUniformLocation(program, name)]));
  const position = gl.getAttribLocation(program, "position"), shade = gl.getAttribLocation(program, "shade");
  gl.enableVertexAttribArray(position); gl.enableVertexAttribArray(shade);
  gl.enable(gl.BLEND); gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA); gl.depthFunc(gl.LEQUAL);

  // A mesh is a list of x, y, z, shade.
  const mesh = (values) => {
    const buffer = gl.createBuffer(), data = values instanceof Float32Array ? values : new Float32Array(values);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return { buffer, count: data.length / 4 };
  };
  const STILL = [0, 0, 1, 0];
  const draw = (what, mode, colour, { pose = STILL, soft = 0, size = 1, count = what.count } = {}) => {
    if (!count) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, what.buffer);
    gl.vertexAttribPointer(position, 3, gl.FLOAT, false, 16, 0); gl.vertexAttribPointer(shade, 1, gl.FLOAT, false, 16, 12);
    gl.uniform4fv(at.pose, pose); gl.uniform4fv(at.colour, colour); gl.uniform1f(at.soft, soft); gl.uniform1f(at.size, size);
    gl.drawArrays(mode, 0, count);
  };

  const floor = mesh([0, 0, 0, 1, width, 0, 0, 1, 0, height, 0, 1, width, height, 0, 1]);
  const lines = [];
  for (let x = 5; x < width; x += 5) lines.push(x, 0, 0.01, 1, x, height, 0.01, 1);
  for (let y = 5; y < height; y += 5) lines.push(0, y, 0.01, 1, width, y, 0.01, 1);
  const grid = mesh(lines);

  const tops = [], sides = [];
  for (const { corners, triangles } of scene.walls) {
    const corner = (k) => [corners[2 * k], corners[2 * k + 1]], number = corners.length / 2;
    for (const k of triangles) tops.push(...corner(k), WALL, 1);
    for (let k = 0; k < number; k++) {
      const [x0, y0] = corner(k), [x1, y1] = corner((k + 1) % number), length = Math.hypot(x1 - x0, y1 - y0) || 1;
      const light = 0.7 + 0.14 * (0.45 * (y1 - y0) - 0.9 * (x0 - x1)) / length;  // the sun stands in the south-east
      sides.push(x0, y0, 0, 0.8 * light, x1, y1, 0, 0.8 * light, x1, y1, WALL, light, x0, y0, 0, 0.8 * light, x1, y1, WALL, light, x0, y0, WALL, light);
    }
  }
  const wallTops = mesh(tops), wallSides = mesh(sides);

  const decode = (text) => {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)), view = new DataView(bytes.buffer);
    return Float32Array.from({ length: bytes.length / 2 }, (_, k) => view.getUint16(2 * k, true) / 1000);
  };
  const body = (radius) => {
    const made = [], top = 0.45, turn = (k) => [radius * Math.cos(k * Math.PI / 16), radius * Math.sin(k * Math.PI / 16)];
    for (let k = 0; k < 32; k++) {
      const [x0, y0] = turn(k), [x1, y1] = turn(k + 1), light = 0.68 + 0.12 * Math.sin((k - 4) * Math.PI / 16);
      made.push(0, 0, top, 1, x0, y0, top, 1, x1, y1, top, 1);
      made.push(x0, y0, 0, light, x1, y1, 0, light, x1, y1, top, light, x0, y0, 0, light, x1, y1, top, light, x0, y0, top, light);
    }
    return mesh(made);
  };
  const nose = (radius) => mesh([0.8 * radius, 0, 0.47, 1, -0.45 * radius, 0.5 * radius, 0.47, 1, -0.45 * radius, -0.5 * radius, 0.47, 1]);

  const robots = scene.robots.map((robot, index) => {
    const ranges = decode(robot.ranges), beams = robot.angles.length, frames = robot.frames, radius = Math.max(robot.radius, 0.012 * Math.max(width, height));
    const lidar = (k) => {
      const [x, y, yaw] = frames.slice(3 * k, 3 * k + 3), c = Math.cos(yaw), s = Math.sin(yaw), [mx, my, turn] = robot.mount;
      return [x + c * mx - s * my, y + s * mx + c * my, yaw + turn];
    };
    const hits = [], until = [0], path = [];
    for (let k = 0; k < times.length; k++) {
      const [x, y, yaw] = lidar(k);
      for (let b = 0; b < beams; b++) {
        const range = ranges[k * beams + b], angle = yaw + robot.angles[b];
        if (range) hits.push(x + range * Math.cos(angle), y + range * Math.sin(angle), WALL + 0.02, 1);
      }
      until.push(hits.length / 4);
      const direction = frames[3 * k + 2], wide = 0.055 * radius / 0.2;
      const sideways = [-Math.sin(direction) * wide, Math.cos(direction) * wide];
      for (const sign of [1, -1]) path.push(frames[3 * k] + sign * sideways[0], frames[3 * k + 1] + sign * sideways[1], 0.03, 1);
    }
    const swept = { buffer: gl.createBuffer(), count: 0 }, beam = { buffer: gl.createBuffer(), count: 0 };
    return { ...robot, index, ranges, beams, lidar, until, swept, beam, hits: mesh(new Float32Array(hits)), path: mesh(path), body: body(radius), nose: nose(radius) };
  });

  const fill = (what, values) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, what.buffer); gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.DYNAMIC_DRAW);
    what.count = values.length / 4;
  };
  // The lidar turns once a second of the show; what it swept last is brightest.
  const sweep = (robot, frame, moment) => {
    const [x, y, yaw] = robot.lidar(frame), now = (2 * Math.PI * moment / Number(speed.value)) % (2 * Math.PI);
    const fan = [], front = [];
    let newest = 7;
    for (let b = 0; b < robot.beams; b++) {
      const next = (b + 1) % robot.beams, r0 = robot.ranges[frame * robot.beams + b], r1 = robot.ranges[frame * robot.beams + next];
      const a0 = yaw + robot.angles[b], a1 = yaw + robot.angles[next];
      const gap = Math.abs(Math.atan2(Math.sin(a1 - a0), Math.cos(a1 - a0)));
      const age = (now - robot.angles[b] + 6 * Math.PI) % (2 * Math.PI), bright = 0.1 + 0.62 * Math.exp(-1.6 * age);
      if (r0 && age < newest) { newest = age; front.splice(0, front.length, r0, a0); }
      if (!r0 || !r1 || gap > 0.2) continue;
      fan.push(x, y, PLANE, bright, x + r0 * Math.cos(a0), y + r0 * Math.sin(a0), PLANE, 0.55 * bright, x + r1 * Math.cos(a1), y + r1 * Math.sin(a1), PLANE, 0.55 * bright);
    }
    fill(robot.swept, fan);
    if (!front.length) { robot.beam.count = 0; return; }
    const [range, angle] = front, tip = [x + range * Math.cos(angle), y + range * Math.sin(angle)];
    const across = [-0.05 * Math.sin(angle), 0.05 * Math.cos(angle)];
    fill(robot.beam, [x - across[0], y - across[1], PLANE + 0.01, 1, x + across[0], y + across[1], PLANE + 0.01, 1, tip[0], tip[1], PLANE + 0.01, 1]);
  };

  // The camera turns about a point of the floor.
  const home = { x: width / 2, y: height / 2, azimuth: -1.25, elevation: 0.95 };
  const camera = {};
  const multiply = (a, b) => Array.from({ length: 16 }, (_, k) => [0, 1, 2, 3].reduce((sum, m) => sum + a[4 * m + k % 4] * b[4 * (k >> 2) + m], 0));
  const view = () => {
    const { x, y, azimuth, elevation, distance } = camera, aspect = canvas.width / canvas.height;
    const ca = Math.cos(azimuth), sa = Math.sin(azimuth), ce = Math.cos(elevation), se = Math.sin(elevation);
    const right = [-sa, ca, 0], back = [ce * ca, ce * sa, se], up = [-se * ca, -se * sa, ce];
    const eye = [x + distance * back[0], y + distance * back[1], distance * back[2]];
    const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
    const looking = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1];
    const f = 1 / Math.tan(FOV / 2), near = distance / 20, far = 20 * distance;
    return multiply([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0], looking);
  };
  const bounds = () => {  // of the world on the screen, -1 to 1 across and up
    const m = view(), corners = [0, width].flatMap((x) => [0, height].flatMap((y) => [0, WALL].map((z) => [x, y, z])));
    const seen = corners.map(([x, y, z]) => [0, 1, 3].map((k) => m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k]));
    if (seen.some(([, , w]) => w <= 0)) return null;
    return [0, 1].map((k) => [Math.min, Math.max].map((extreme) => extreme(...seen.map((one) => one[k] / one[2]))));
  };
  const frameAll = () => {  // come nearer as long as all stays in view and in the middle
    for (camera.distance = 8 * Math.max(width, height); camera.distance > 2; camera.distance *= 0.98) {
      const box = bounds();
      if (!box) return;
      const [[left, right], [low, high]] = box;
      shift(-(left + right) / 4 * canvas.clientWidth, (low + high) / 4 * canvas.clientHeight);
      if (right - left > 1.88 || high - low > 1.82) return;
    }
  };
  const reset = (changes = {}) => { Object.assign(camera, home, changes); frameAll(); ask(); };

  const rgb = (name) => {
    const text = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    return [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16) / 255);
  };
  const frameOf = (moment) => {
    let low = 0, high = times.length - 1;
    while (low < high) { const middle = (low + high + 1) >> 1; if (times[middle] <= moment + 1e-9) low = middle; else high = middle - 1; }
    return low;
  };
  const poseOf = (robot, frame, moment) => {
    const next = Math.min(frame + 1, times.length - 1), share = next === frame ? 0 : Math.min(1, (moment - times[frame]) / (times[next] - times[frame]));
    const [x0, y0, a0, x1, y1, a1] = [...robot.frames.slice(3 * frame, 3 * frame + 3), ...robot.frames.slice(3 * next, 3 * next + 3)];
    const yaw = a0 + share * Math.atan2(Math.sin(a1 - a0), Math.cos(a1 - a0));
    return [x0 + share * (x1 - x0), y0 + share * (y1 - y0), Math.cos(yaw), Math.sin(yaw)];
  };

  let moment = end, playing = false, asked = 0, before = 0;
  const paint = (now) => {
    asked = 0;
    if (playing) {
      moment = Math.min(end, moment + Number(speed.value) * Math.min(0.1, (now - before) / 1000));
      if (moment >= end) stop();
      slider.value = moment;
    }
    before = now;
    const frame = frameOf(moment), dots = Math.max(1.6, 1.5 * devicePixelRatio);
    clock.textContent = `${moment.toFixed(1)} of ${end.toFixed(0)} s`;
    slider.setAttribute("aria-valuetext", `${moment.toFixed(1)} seconds`);
    const sky = rgb("--bg"), wall = rgb("--wall"), floorTone = rgb("--floor"), ink = rgb("--ink");
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...sky, 1); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(at.view, false, view());
    gl.enable(gl.DEPTH_TEST); gl.depthMask(true);
    draw(floor, gl.TRIANGLE_STRIP, [...floorTone, 1]);
    draw(grid, gl.LINES, [...ink, 0.09]);
    draw(wallSides, gl.TRIANGLES, [...wall, 1]);
    draw(wallTops, gl.TRIANGLES, [...wall, 1]);
    for (const robot of robots) {
      const colour = rgb(`--c${robot.index % 8}`), pose = poseOf(robot, frame, moment);
      draw(robot.path, gl.TRIANGLE_STRIP, [...colour, 1], { count: 2 * (frame + 1) });
      draw(robot.body, gl.TRIANGLES, [...colour, 1], { pose });
      draw(robot.nose, gl.TRIANGLES, [...sky, 1], { pose });
    }
    gl.depthMask(false);
    for (const robot of robots) {
      const colour = rgb(`--c${robot.index % 8}`);
      draw(robot.hits, gl.POINTS, [...colour, 0.75], { count: robot.until[frame + 1], size: dots });
      sweep(robot, frame, moment);
      draw(robot.swept, gl.TRIANGLES, [...colour, 0.55], { soft: 1 });
      draw(robot.beam, gl.TRIANGLES, [...colour, 1]);
    }
    if (playing) ask();
  };
  const ask = () => { if (!asked) asked = requestAnimationFrame(paint); };
  const stop = () => { playing = false; play.textContent = "Play"; };
  const start = () => {
    if (moment >= end) moment = 0;
    playing = true; before = performance.now(); play.textContent = "Pause"; ask();
  };

  slider.max = end; slider.value = end;
  slider.addEventListener("input", () => { moment = Number(slider.value); ask(); });
  play.addEventListener("click", () => { if (playing) stop(); else start(); });
  speed.addEventListener("change", ask);
  $("#from-above").addEventListener("click", () => reset({ azimuth: -Math.PI / 2, elevation: Math.PI / 2 - 1e-3 }));
  $("#from-aside").addEventListener("click", () => reset());

  const turn = (dx, dy) => {
    camera.azimuth -= dx; camera.elevation = Math.min(Math.PI / 2 - 1e-3, Math.max(0.12, camera.elevation + dy)); ask();
  };
  const zoom = (factor) => { camera.distance = Math.min(8 * Math.max(width, height), Math.max(2, camera.distance * factor)); ask(); };
  const shift = (dx, dy) => {
    const scale = 2 * camera.distance * Math.tan(FOV / 2) / canvas.clientHeight, ca = Math.cos(camera.azimuth), sa = Math.sin(camera.azimuth);
    camera.x += scale * (sa * dx - ca * dy); camera.y += scale * (-ca * dx - sa * dy); ask();
  };
  const held = new Map();
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); held.set(event.pointerId, [event.clientX, event.clientY]); });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => held.delete(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    const last = held.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last[0], dy = event.clientY - last[1];
    if (held.size === 2) {
      const other = [...held].find(([id]) => id !== event.pointerId)[1], apart = (to) => Math.hypot(to[0] - other[0], to[1] - other[1]) || 1;
      zoom(apart(last) / apart([event.clientX, event.clientY])); shift(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons === 2) shift(dx, dy);
    else turn(dx / 200, dy / 200);
    held.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;  // else the page could not be scrolled past it
    event.preventDefault(); zoom(Math.exp(event.deltaY / 600));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const keys = {
      ArrowLeft: () => turn(0.08, 0), ArrowRight: () => turn(-0.08, 0), ArrowUp: () => turn(0, 0.06), ArrowDown: () => turn(0, -0.06),
      "+": () => zoom(0.9), "-": () => zoom(1.1), Home: () => reset(), " ": () => play.click(),
    };
    if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
  });

  let framed = false;
  new ResizeObserver(() => {
    canvas.width = Math.round(canvas.clientWidth * devicePixelRatio); canvas.height = Math.round(canvas.clientHeight * devicePixelRatio);
    if (!framed) { framed = true; reset(); }
    ask();
  }).observe(canvas);
  new MutationObserver(ask).observe(document.documentElement, { attributeFilter: ["data-theme"] });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", ask);
})();
