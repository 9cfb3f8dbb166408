// What buttons, keys and pointers do.

function show(number) {
  frame = Math.min(Math.max(number, 0), run.frames.length - 1);
  draw();
}

function play(start) {
  clearInterval(timer);
  timer = start ? setInterval(() => show((frame + 1) % run.frames.length), 1000 / FRAMES_PER_SECOND) : null;
  element("play").textContent = start ? "stop" : "play";
}

function zoom(factor) {
  view.zoom = Math.min(Math.max(view.zoom * factor, 0.1), 50);
  draw();
}

function reset() {
  view = initial();
  draw();
}

function toggle(id) {
  element(id).checked = !element(id).checked;
  draw();
}

function next(id) {
  const { options, selectedIndex } = element(id);
  const others = [...options.keys()].map((n) => (selectedIndex + 1 + n) % options.length);
  element(id).selectedIndex = others.find((n) => !options[n].disabled);
  draw();
}

const keys = {
  " ": () => play(timer === null),
  ArrowLeft: () => show(frame - 1),
  ArrowRight: () => show(frame + 1),
  Home: () => show(0),
  End: () => show(run.frames.length - 1),
  "+": () => zoom(1.2),
  "=": () => zoom(1.2),
  "-": () => zoom(1 / 1.2),
  0: reset,
  c: () => next("colour"),
  l: () => next("lines"),
  w: () => toggle("wrap"),
  i: () => toggle("images"),
};

window.addEventListener("keydown", (event) => {
  // Fields have keys of their own.
  const isField = ["INPUT", "SELECT", "BUTTON"].includes(event.target.tagName);
  if (event.ctrlKey || event.metaKey || event.altKey || isField || !keys[event.key]) return;
  event.preventDefault();
  keys[event.key]();
});

canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
canvas.addEventListener("pointermove", (event) => {
  if (!canvas.hasPointerCapture(event.pointerId)) return;
  if (flat || event.shiftKey) {
    view.shift = [view.shift[0] + event.movementX, view.shift[1] + event.movementY];
  } else {
    view.yaw += 0.008 * event.movementX;
    view.pitch = Math.min(Math.max(view.pitch + 0.008 * event.movementY, -Math.PI / 2), Math.PI / 2);
  }
  draw();
});
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(-0.0015 * event.deltaY));
}, { passive: false });

element("play").addEventListener("click", () => play(timer === null));
element("back").addEventListener("click", () => show(frame - 1));
element("forth").addEventListener("click", () => show(frame + 1));
element("reset").addEventListener("click", reset);
element("frame").addEventListener("input", () => show(Number(element("frame").value)));
["colour", "lines", "reach", "wrap", "images"].forEach((id) => element(id).addEventListener("input", draw));
window.addEventListener("resize", draw);
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);

// Chooses what is wanted, unless the run does not have it.
function choose(id, value) {
  const chosen = [...element(id).options].find((option) => option.value === value);
  if (chosen && !chosen.disabled) element(id).value = value;
}

function withhold(id, value, why) {
  const option = [...element(id).options].find((one) => one.value === value);
  option.disabled = true;
  option.textContent += ` (${why})`;
}

// `view.html#frame=20&colour=spin&lines=forces&images` begins with that frame, colour, lines and box.
function begin() {
  if (flat) element("help").textContent = "drag: move \u00b7 wheel or + \u2212: zoom";
  element("frame").max = run.frames.length - 1;
  const wanted = new URLSearchParams(location.hash.slice(1));
  element("images").checked = flat || wanted.has("images");
  if (!hasForces) withhold("colour", "contact-force", "none in the frames");
  if (!hasContacts) withhold("lines", "forces", "no table of them");
  ["colour", "lines"].forEach((id) => choose(id, wanted.get(id)));
  show(Math.trunc(Number(wanted.get("frame"))) || 0);
}

begin();
