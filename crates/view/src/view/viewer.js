"use strict";
// Shows the frames of a run on a canvas. Coordinates of the run: x along the shear, y up, z towards the reader.
// The view turns them about the middle of the box; depth is what then points to the reader.

const run = JSON.parse(document.getElementById("run").textContent);
const element = (id) => document.getElementById(id);
const canvas = element("canvas");
const pen = canvas.getContext("2d");
const count = run.radii.length;
const meanRadius = run.radii.reduce((sum, radius) => sum + radius, 0) / count;
const largestRadius = run.radii.reduce((most, radius) => Math.max(most, radius), 0);
const flat = run.dimension === 2;
const SMALLEST_GAP = 1e-4; // in mean radii: the rounding of positions
const FRAMES_PER_SECOND = 20;
const MOST_CELLS = 10000; // along an axis

// Dark to light, so that order is seen without colours too.
const SCALE = [[68, 1, 84], [72, 37, 118], [65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140], [34, 168, 132],
  [68, 191, 112], [122, 209, 81], [189, 223, 38], [253, 231, 37]]; // viridis
const PARTICLES = [[43, 110, 190], [214, 90, 40], [38, 145, 95], [155, 85, 180], [209, 164, 22], [120, 120, 120]];

const initial = () => ({ yaw: flat ? 0 : -0.55, pitch: flat ? 0 : 0.35, zoom: 1, shift: [0, 0] });
let view = initial();
let frame = 0;
let timer = null;

window.addEventListener("error", (event) => { element("fault").textContent = event.message; });

// Vectors

const at = (numbers, i) => [numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]];
const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);

// The box and its periods

// Displacement of the image above against the box, brought to at most half an edge.
function tilt(now) {
  const period = run.edges[0];
  return run.periodic[0] ? now.tilt - period * Math.round(now.tilt / period) : now.tilt;
}

// A vector less whole periods, each taken so that `rounding` of its number is 0.
function reduced(x, now, rounding) {
  const [lx, ly, lz] = run.edges;
  const [px, py, pz] = run.periodic;
  const up = py ? rounding(x[1] / ly) : 0;
  const y = x[1] - up * ly;
  const alongX = x[0] - up * tilt(now);
  // The box is a parallelogram: its left border at this height.
  const border = rounding === Math.floor && py ? tilt(now) * y / ly : 0;
  const right = px ? rounding((alongX - border) / lx) : 0;
  const front = pz ? rounding(x[2] / lz) : 0;
  return [alongX - right * lx, y, x[2] - front * lz];
}

const nearest = (x, now) => reduced(x, now, Math.round);
const wrapped = (x, now) => plus(run.origin, reduced(minus(x, run.origin), now, Math.floor));

function corners(now) {
  const [lx, ly, lz] = run.edges;
  const sheared = run.periodic[1] ? tilt(now) : 0;
  return [0, 1, 2, 3, 4, 5, 6, 7].map((n) =>
    plus(run.origin, [(n & 1) * lx + ((n >> 1) & 1) * sheared, ((n >> 1) & 1) * ly, ((n >> 2) & 1) * lz]));
}

// What a frame tells

// Particles by cells of the box without its tilt, as wide as `range` at least: what is nearer than that is in
// the same cell or the next. Cells at a border without a period hold what lies beyond it, too.
function cells(now, range) {
  const slope = run.periodic[1] ? tilt(now) / run.edges[1] : 0;
  const counts = run.edges.map((edge, d) =>
    Math.min(Math.max(Math.floor(edge / (range * (d === 0 ? Math.hypot(1, slope) : 1))), 1), MOST_CELLS));
  const members = new Map();
  const places = run.radii.map((_, i) => {
    const x = reduced(minus(at(now.positions, i), run.origin), now, Math.floor);
    x[0] -= slope * x[1];
    const place = x.map((along, d) =>
      Math.min(Math.max(Math.floor(along / run.edges[d] * counts[d]) || 0, 0), counts[d] - 1));
    const cell = (place[0] * counts[1] + place[1]) * counts[2] + place[2];
    if (!members.has(cell)) members.set(cell, []);
    members.get(cell).push(i);
    return place;
  });
  // The cell before, this one and the next along an axis; none twice.
  const along = (d, cell) => {
    const beside = [cell - 1, cell, cell + 1];
    if (!run.periodic[d]) return beside.filter((other) => other >= 0 && other < counts[d]);
    return [...new Set(beside.map((other) => (other + counts[d]) % counts[d]))];
  };
  // Particles after particle `i` that are near it, in order.
  return (i) => {
    const [xs, ys, zs] = places[i].map((cell, d) => along(d, cell));
    const near = [];
    for (const x of xs) for (const y of ys) for (const z of zs) {
      for (const j of members.get((x * counts[1] + y) * counts[2] + z) || []) if (j > i) near.push(j);
    }
    return near.sort((a, b) => a - b);
  };
}

// Pairs with a gap up to one mean radius, of nearest images; gaps in mean radii. Kept once they are known.
function pairs(now) {
  if (now.pairs) return now.pairs;
  now.pairs = [];
  const near = cells(now, 2 * largestRadius + meanRadius);
  for (let i = 0; i < count; i++) {
    near(i).forEach((j) => {
      const apart = nearest(minus(at(now.positions, j), at(now.positions, i)), now);
      const gap = (norm(apart) - run.radii[i] - run.radii[j]) / meanRadius;
      if (gap <= 1) now.pairs.push({ i, j, apart, gap });
    });
  }
  return now.pairs;
}

// The rotation about z since the first frame, by the trapezoidal rule: frames hold spins only.
function turns() {
  if (run.turns) return run.turns;
  run.turns = [new Float64Array(count)];
  for (let n = 1; n < run.frames.length; n++) {
    const [before, after] = [run.frames[n - 1], run.frames[n]];
    const half = 0.5 * (after.time - before.time);
    run.turns.push(run.turns[n - 1].map((turn, i) => turn + half * (before.spins[3 * i + 2] + after.spins[3 * i + 2])));
  }
  return run.turns;
}

// Frames of a run without a contact model have no forces.
const hasForces = run.frames.every((now) => now.forces.length === 3 * count);

// Neither have those without a table of near pairs contacts.
const CONTACT_NUMBERS = 7;
const hasContacts = run.frames.every((now) => now.contacts);

// The contacts of a frame: normal forces are over 6 pi eta; walls are no partner.
function contacts(now) {
  const found = [];
  for (let n = 0; n < now.contacts.length; n += CONTACT_NUMBERS) {
    const [i, j, x, y, z, force, slides] = now.contacts.slice(n, n + CONTACT_NUMBERS);
    found.push({ i, j: j < 0 ? null : j, apart: [x, y, z], force: Math.abs(force), slides: slides > 0, hasFriction: slides >= 0 });
  }
  return found;
}

// Numbers of the particles that decide their colours.
const measures = {
  speed: (now) => run.radii.map((_, i) => norm(at(now.velocities, i))),
  spin: (now) => run.radii.map((_, i) => norm(at(now.spins, i))),
  "contact-force": (now) => run.radii.map((_, i) => norm(at(now.forces, i))),
  gap: (now) => {
    const gaps = new Array(count).fill(1);
    pairs(now).forEach(({ i, j, gap }) => { gaps[i] = Math.min(gaps[i], gap); gaps[j] = Math.min(gaps[j], gap); });
    return gaps.map((gap) => Math.log10(Math.max(gap, SMALLEST_GAP)));
  },
};

// From 0 to the largest value in all frames, so that a colour means the same thing in each.
const ranges = { gap: [Math.log10(SMALLEST_GAP), 0] };
function range(name) {
  if (!ranges[name]) {
    let high = 0;
    run.frames.forEach((now) => measures[name](now).forEach((value) => { high = Math.max(high, value); }));
    ranges[name] = [0, high];
  }
  return ranges[name];
}

// Colours

function scaled(fraction) {
  const place = Math.min(Math.max(fraction, 0), 1) * (SCALE.length - 1);
  const first = Math.min(Math.floor(place), SCALE.length - 2);
  return SCALE[first].map((c, k) => c + (place - first) * (SCALE[first + 1][k] - c));
}

function colours(now) {
  const name = element("colour").value;
  if (name === "id") return run.radii.map((_, i) => PARTICLES[i % PARTICLES.length]);
  const [low, high] = range(name);
  return measures[name](now).map((value) => scaled(high > low ? (value - low) / (high - low) : 0));
}

const css = ([r, g, b], light = 1) =>
  `rgb(${[r, g, b].map((c) => Math.round(light > 1 ? c + (255 - c) * (light - 1) : c * light)).join(",")})`;
const themed = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);

// Projection

function camera() {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  const [lx, ly, lz] = run.edges;
  const middle = plus(run.origin, [lx / 2, ly / 2, lz / 2]);
  // A sheared box sticks out by at most a quarter of its edge on either side of its middle.
  const breadth = run.periodic[1] ? 1.5 * lx : lx;
  const border = run.periodic.some(Boolean) ? 2 * largestRadius : 0; // for images
  const room = flat ? [breadth + border, ly + border] : [Math.hypot(lx, ly, lz), Math.hypot(lx, ly, lz)];
  const scale = 0.88 * view.zoom * Math.min(width / room[0], height / room[1]);
  const [sy, cy, sp, cp] = [Math.sin(view.yaw), Math.cos(view.yaw), Math.sin(view.pitch), Math.cos(view.pitch)];
  const sheared = (now) => (run.periodic[1] ? tilt(now) / 2 : 0);
  const project = (x, now) => {
    const d = minus(x, plus(middle, [sheared(now), 0, 0]));
    const [a, b] = [cy * d[0] + sy * d[2], -sy * d[0] + cy * d[2]];
    const [up, depth] = [cp * d[1] - sp * b, sp * d[1] + cp * b];
    return { x: width / 2 + view.shift[0] + scale * a, y: height / 2 + view.shift[1] - scale * up, depth };
  };
  return { project, scale, width, height };
}

// Drawing

function line(from, to, colour, width, dashes = []) {
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.setLineDash(dashes);
  pen.beginPath();
  pen.moveTo(from.x, from.y);
  pen.lineTo(to.x, to.y);
  pen.stroke();
  pen.setLineDash([]);
}

// The edges at the nearest corner, or all others.
function drawBox(eye, now, inFront) {
  const ends = corners(now).map((corner) => eye.project(corner, now));
  const first = ends.reduce((best, end, n) => (end.depth > ends[best].depth ? n : best), 0);
  const isInFront = (n, bit) => !flat && (n === first || (n | bit) === first);
  for (let n = 0; n < 8; n++) {
    [1, 2, 4].filter((bit) => !(n & bit) && !(flat && (bit === 4 || n & 4))).forEach((bit) => {
      if (isInFront(n, bit) !== inFront) return;
      // Walls of the plane are solid, periodic borders dashed.
      const isPeriodic = flat && run.periodic[bit === 1 ? 1 : 0];
      line(ends[n], ends[n | bit], themed("--edge"), 1.2, isPeriodic ? [6, 4] : []);
    });
  }
}

// Images of a ball that reach into the box, without the ball.
function images(x, radius, now) {
  const found = [];
  const steps = run.periodic.map((periodic) => (periodic ? [-1, 0, 1] : [0]));
  const [lx, ly, lz] = run.edges;
  for (const p of steps[0]) for (const q of steps[1]) for (const r of steps[2]) {
    if (!p && !q && !r) continue;
    const image = plus(x, [p * lx + q * tilt(now), q * ly, r * lz]);
    const d = minus(image, run.origin);
    const slope = run.periodic[1] ? tilt(now) / ly : 0;
    const along = (d[0] - slope * d[1]) / Math.hypot(1, slope);
    const reach = lx / Math.hypot(1, slope);
    const meets = (value, length) => value > -radius && value < length + radius;
    if (meets(along, reach) && meets(d[1], ly) && (flat || meets(d[2], lz))) found.push(image);
  }
  return found;
}

// Balls from back to front.
function balls(eye, now) {
  const [inBox, withImages] = [element("wrap").checked, element("images").checked];
  const fill = colours(now);
  const list = [];
  for (let i = 0; i < count; i++) {
    const own = at(now.positions, i);
    const place = inBox ? wrapped(own, now) : own;
    list.push({ i, image: false, colour: fill[i], ...eye.project(place, now) });
    if (withImages && inBox) {
      images(place, run.radii[i], now).forEach((image) =>
        list.push({ i, image: true, colour: fill[i], ...eye.project(image, now) }));
    }
  }
  return list.sort((a, b) => a.depth - b.depth);
}

function drawBall(ball, eye, turn) {
  const radius = Math.max(eye.scale * run.radii[ball.i], 0.5);
  pen.globalAlpha = ball.image ? 0.3 : 1;
  if (flat) {
    pen.fillStyle = css(ball.colour);
  } else {
    const light = pen.createRadialGradient(
      ball.x - 0.35 * radius, ball.y - 0.4 * radius, 0.05 * radius, ball.x, ball.y, radius);
    light.addColorStop(0, css(ball.colour, 1.65));
    light.addColorStop(0.45, css(ball.colour, 1));
    light.addColorStop(1, css(ball.colour, 0.42));
    pen.fillStyle = light;
  }
  pen.beginPath();
  pen.arc(ball.x, ball.y, radius, 0, 2 * Math.PI);
  pen.fill();
  pen.strokeStyle = css(ball.colour, 0.5);
  pen.lineWidth = 0.8;
  pen.stroke();
  if (flat) {
    const end = { x: ball.x + 0.9 * radius * Math.cos(turn), y: ball.y - 0.9 * radius * Math.sin(turn) };
    line(ball, end, "rgba(255,255,255,0.9)", Math.max(0.08 * radius, 1));
  }
  pen.globalAlpha = 1;
}

// The largest normal force in all frames, so that a width means the same thing in each.
function largestForce() {
  run.largestForce ??= run.frames.flatMap(contacts).reduce((most, { force }) => Math.max(most, force), 0);
  return run.largestForce;
}

// A line of a contact with this share of the largest force; those that slip are dashed.
const ofContact = (share, slides) =>
  ({ width: 1 + 8 * share, colour: slides ? "--slip" : "--link", dashes: slides ? [6, 3] : [] });

// Lines from centre to centre.
const lines = {
  none: () => [],
  pairs: (now) => pairs(now).filter(({ gap }) => gap <= 10 ** Number(element("reach").value)).map((pair) =>
    ({ ...pair, width: 1 + 0.8 * Math.log10(1 / Math.max(pair.gap, SMALLEST_GAP)), colour: "--link", dashes: [] })),
  forces: (now) => contacts(now).map((contact) => ({ ...contact, ...ofContact(contact.force / largestForce(), contact.slides) })),
};

function drawLines(eye, now) {
  const inBox = element("wrap").checked;
  const drawn = lines[element("lines").value](now);
  drawn.forEach(({ i, j, apart, width, colour, dashes }) => {
    const partner = j === null ? [] : [[j, apart.map((x) => -x)]];
    const ends = [[i, apart], ...partner].map(([n, step]) => {
      const start = inBox ? wrapped(at(now.positions, n), now) : at(now.positions, n);
      return [eye.project(start, now), eye.project(plus(start, step), now)];
    });
    // Across a border the pair is seen at both ends; elsewhere both lines are the same.
    const across = j !== null && Math.hypot(ends[0][1].x - ends[1][0].x, ends[0][1].y - ends[1][0].y) > 0.5;
    (across ? ends : ends.slice(0, 1)).forEach(([from, to]) => {
      line(from, to, themed("--paper"), width + 2.5);
      line(from, to, themed(colour), width, dashes);
    });
  });
  return drawn.length;
}

// What the widths of lines tell.
function drawLegendOfForces(eye) {
  if (element("lines").value !== "forces") return;
  const [left, top, width] = [eye.width - 216, eye.height - 40, 200];
  pen.globalAlpha = 0.8;
  pen.fillStyle = themed("--paper");
  pen.fillRect(left - 8, top - 24, width + 24, 60);
  pen.globalAlpha = 1;
  pen.font = "13px system-ui, sans-serif";
  pen.textAlign = "left";
  const knowsSlip = run.frames.flatMap(contacts).some(({ hasFriction }) => hasFriction);
  (knowsSlip ? [["sticks", false], ["slips", true]] : [["touches", false]]).forEach(([name, slides], n) => {
    const start = left + 100 * n;
    const stroke = ofContact(0.4, slides);
    line({ x: start, y: top + 6 }, { x: start + 36, y: top + 6 }, themed(stroke.colour), stroke.width, stroke.dashes);
    pen.fillStyle = themed("--ink");
    pen.fillText(name, start + 44, top + 10);
  });
  pen.fillText(`widest: force / 6\u03c0\u03b7 = ${largestForce().toPrecision(3)}`, left, top + 30);
  pen.fillText("contacts", left, top - 8);
}

function drawLegend(eye) {
  const name = element("colour").value;
  if (name === "id") return;
  const [left, top, width, height] = [16, eye.height - 40, 160, 10];
  pen.globalAlpha = 0.8;
  pen.fillStyle = themed("--paper");
  pen.fillRect(left - 8, top - 24, width + 24, 60);
  pen.globalAlpha = 1;
  const fill = pen.createLinearGradient(left, 0, left + width, 0);
  for (let n = 0; n <= 20; n++) fill.addColorStop(n / 20, css(scaled(n / 20)));
  pen.fillStyle = fill;
  pen.fillRect(left, top, width, height);
  pen.fillStyle = themed("--ink");
  pen.font = "13px system-ui, sans-serif";
  const digits = (value) => Number((name === "gap" ? 10 ** value : value).toPrecision(3)).toString();
  const title = { speed: "speed", spin: "spin (angular speed)", gap: "smallest gap, mean radii",
    "contact-force": "contact force / 6\u03c0\u03b7" }[name];
  pen.textAlign = "left";
  pen.fillText(title, left, top - 6);
  pen.fillText(digits(range(name)[0]), left, top + 24);
  pen.textAlign = "right";
  pen.fillText(digits(range(name)[1]), left + width, top + 24);
}

function describe(now, drawn) {
  const smallest = pairs(now).reduce((least, { gap }) => Math.min(least, gap), Infinity);
  const gap = smallest > 1 ? "above 1" : smallest < SMALLEST_GAP ? `below ${SMALLEST_GAP}` : smallest.toPrecision(2);
  const strain = run.frames.some((one) => one.strain !== 0) ? `strain ${now.strain.toPrecision(4)}, ` : "";
  const linked = element("lines").value === "none" ? "" : `, pairs drawn: ${drawn}`;
  element("facts").textContent = `frame ${frame + 1} of ${run.frames.length}, t = ${now.time.toPrecision(4)}, `
    + `${strain}${count} particles, smallest gap ${gap} radii${linked}`;
  element("reach-text").textContent = (10 ** Number(element("reach").value)).toPrecision(2);
  element("reach").disabled = element("lines").value !== "pairs";
  element("frame").value = frame;
  canvas.setAttribute("aria-label", element("facts").textContent);
  document.body.dataset.frame = frame;
  document.body.dataset.pairs = drawn;
  document.body.dataset.colour = element("colour").value;
  document.body.dataset.lines = element("lines").value;
}

function draw() {
  const now = run.frames[frame];
  const eye = camera();
  pen.clearRect(0, 0, eye.width, eye.height);
  drawBox(eye, now, false);
  const list = balls(eye, now);
  list.forEach((ball) => drawBall(ball, eye, flat ? turns()[frame][ball.i] : 0));
  drawBox(eye, now, true);
  const drawn = drawLines(eye, now);
  drawLegend(eye);
  drawLegendOfForces(eye);
  describe(now, drawn);
  document.body.dataset.balls = list.length;
}
