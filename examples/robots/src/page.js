const stage = document.getElementById("stage");
const slider = document.getElementById("time");
const SVG = "http://www.w3.org/2000/svg";
const make = (tag, attributes) => {
  const element = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  stage.appendChild(element);
  return element;
};
const place = (element, [x, y]) => element.setAttribute("transform", `translate(${x} ${y})`);
const drawn = RUN.colours.map((colour) => ({
  goal: make("circle", { r: 1, fill: colour }),
  ref: make("circle", { r: RUN.radius, fill: "none", stroke: colour, "stroke-width": 0.2, "stroke-dasharray": "1 .7" }),
  newest: make("path", { d: "M-1.2 -1.2L1.2 1.2M-1.2 1.2L1.2 -1.2", stroke: colour, "stroke-width": 0.3 }),
  body: make("circle", { r: RUN.radius, fill: colour, "fill-opacity": 0.45, stroke: colour, "stroke-width": 0.3 }),
  nose: make("path", { stroke: "#222", "stroke-width": 0.4 }),
}));
const rows = RUN.colours.map((colour, robot) => {
  const row = document.getElementById("statuses").insertRow();
  row.insertCell().textContent = robot + 1;
  row.cells[0].style.color = colour;
  return row.insertCell();
});
const show = (time) => {
  const step = Math.min(Math.floor(time), RUN.steps.length - 1);
  document.getElementById("step").textContent = step;
  drawn.forEach((parts, robot) => {
    const now = RUN.steps[step][robot];
    const k = Math.floor((time - step) * now.path.length);
    const before = step > 0 ? RUN.steps[step - 1][robot].path.at(-1) : RUN.starts[robot];
    const at = k > 0 ? now.path[Math.min(k, now.path.length) - 1] : before;
    place(parts.body, at);
    place(parts.goal, now.goal);
    place(parts.ref, now.ref);
    place(parts.newest, now.newest);
    const [c, s] = now.heading.map((h) => RUN.radius * h);
    parts.nose.setAttribute("d", `M${at[0]} ${at[1]}L${at[0] + c} ${at[1] + s}`);
    rows[robot].textContent = now.status;
  });
};
let playing = null;
document.getElementById("play").onclick = (event) => {
  if (playing) {
    clearInterval(playing);
    playing = null;
  } else {
    playing = setInterval(() => {
      const next = Number(slider.value) + 0.05;
      slider.value = next >= RUN.steps.length ? 0 : next;
      show(Number(slider.value));
    }, 50);
  }
  event.target.textContent = playing ? "pause" : "play";
};
slider.oninput = () => show(Number(slider.value));
show(0);
