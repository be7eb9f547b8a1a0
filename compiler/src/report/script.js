"use strict";
// Read-outs, choices and a test of itself. The page can be read without.
(() => {
  const root = document.documentElement;
  const put = (id, text) => {
    let place = document.getElementById(id);
    if (!place) {
      place = document.createElement("pre");
      place.id = id;
      document.body.append(place);
    }
    place.textContent += text + "\n";
  };
  window.addEventListener("error", (event) => put("errors", event.message || "a resource is missing"), true);

  const short = (x) => (x === 0 || (Math.abs(x) >= 1e-3 && Math.abs(x) < 1e6) ? String(+x.toPrecision(4)) : x.toExponential(3));
  const node = (name, attributes) => {
    const made = document.createElementNS(document.querySelector("svg").namespaceURI, name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    return made;
  };
  const say = (from, text) => {
    const readout = from.closest("figure")?.querySelector(".readout");
    if (!readout || !text) return;
    readout.textContent = text;
    readout.classList.add("said");
  };
  // `h1 [cm]` and 2 make `h1 = 2 cm`.
  const stated = (label, value) => {
    const [, name, unit] = /^(.*?)(?: \[([^\]]*)\])?$/.exec(label);
    return `${name} = ${short(value)}${unit ? " " + unit : ""}`;
  };

  // Planes and charts: what is under the pointer, in the user's numbers.
  const opened = new WeakMap();
  const chart = (svg) => {
    if (opened.has(svg)) return opened.get(svg);
    const [left, top, width, height, x0, x1, y0, y1] = svg.dataset.frame.split(" ").map(Number);
    const made = {
      svg, left, top, width, height,
      at: [left + width / 2, top + height / 2],
      x: (px) => x0 + ((px - left) / width) * (x1 - x0),
      y: (py) => y1 - ((py - top) / height) * (y1 - y0),
    };
    opened.set(svg, made);
    return made;
  };
  const curves = (shown) => [...shown.svg.querySelectorAll("polyline[data-name]")].map((line) => ({
    name: line.dataset.name,
    points: line.getAttribute("points").trim().split(" ").map((pair) => pair.split(",").map(Number)),
  }));
  const height = (points, px) => {
    const last = points.length - 1;
    if (last < 0 || px < points[0][0] - 0.01 || px > points[last][0] + 0.01) return null;
    let k = 1;
    while (k < last && points[k][0] <= px) k += 1;
    const [a, b] = [points[Math.max(k - 1, 0)], points[Math.min(k, last)]];
    return b[0] > a[0] ? a[1] + ((Math.min(px, b[0]) - a[0]) / (b[0] - a[0])) * (b[1] - a[1]) : b[1];
  };
  const point = (shown, px, py) => {
    const { svg, left, top, width, height: tall } = shown;
    px = Math.min(Math.max(px, left), left + width);
    py = Math.min(Math.max(py, top), top + tall);
    shown.at = [px, py];
    const cross = svg.querySelector(".cross");
    cross.replaceChildren(node("line", { x1: px, x2: px, y1: top, y2: top + tall }));
    if (svg.dataset.kind === "plane") {
      cross.append(node("line", { x1: left, x2: left + width, y1: py, y2: py }));
      const place = svg.createSVGPoint();
      [place.x, place.y] = [px, py];
      const inside = [...svg.querySelectorAll("polygon[data-set]")].filter((shape) => shape.isPointInFill(place));
      const sets = inside.length ? " in " + inside.map((shape) => shape.dataset.set).join(", ") : " in none of the sets";
      say(svg, `${stated(svg.dataset.x, shown.x(px))}, ${stated(svg.dataset.y, shown.y(py))},${sets}`);
      return;
    }
    shown.curves ??= curves(shown);
    const unit = /\[[^\]]*\]$/.exec(svg.dataset.y)?.[0] ?? "";
    const values = shown.curves.flatMap(({ name, points }) => {
      const at = height(points, px);
      if (at === null) return [];
      cross.append(node("circle", { cx: px, cy: at, r: 2.6 }));
      return [stated(`${name} ${unit}`, shown.y(at))];
    });
    say(svg, `${stated(svg.dataset.x, shown.x(px))}: ${values.join(", ") || "no design"}`);
  };
  const follow = (event) => {
    const svg = event.target.closest?.("svg.plot");
    if (!svg) return;
    const matrix = svg.getScreenCTM();
    if (!matrix) return;
    const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    point(chart(svg), place.x, place.y);
  };
  document.addEventListener("pointermove", follow);
  document.addEventListener("pointerdown", follow);
  document.addEventListener("keydown", (event) => {
    const svg = event.target.closest?.("svg.plot");
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!svg || !step) return;
    event.preventDefault();
    const shown = chart(svg);
    const far = event.shiftKey ? 20 : 4;
    point(shown, shown.at[0] + far * step[0], shown.at[1] + far * step[1]);
  });
  // Parts of bars, arrows, nodes: what their titles say.
  const titled = (event) => {
    const part = event.target.closest?.("svg:not(.plot) *");
    const title = part?.querySelector?.(":scope > title") ?? part?.closest("g.node")?.querySelector(":scope > title");
    const inner = title ?? event.target.querySelector?.("g.node > title");
    if (inner) say(event.target, inner.textContent);
  };
  document.addEventListener("pointerover", titled);
  document.addEventListener("focusin", titled);

  // One pair of signals at a time.
  for (const planes of document.querySelectorAll("[data-choose]")) {
    const pairs = [...planes.querySelectorAll(":scope > .pair")];
    if (pairs.length < 2) continue;
    const choice = document.createElement("select");
    choice.setAttribute("aria-label", `Which ${planes.dataset.choose}`);
    pairs.forEach((pair, k) => choice.append(new Option(pair.dataset.pair, k)));
    const show = () => pairs.forEach((pair, k) => (pair.hidden = k !== Number(choice.value)));
    choice.addEventListener("change", show);
    planes.querySelector("h4").append(choice);
    show();
  }

  // What is linked to is unfolded, and everything before printing.
  const unfold = () => {
    const target = location.hash.length > 1 && document.getElementById(location.hash.slice(1));
    for (let at = target; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true;
    if (target) target.scrollIntoView();
  };
  window.addEventListener("hashchange", unfold);
  window.addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => (part.open = true)));

  const dark = () => (root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches);
  const theme = document.getElementById("theme");
  theme.hidden = false;
  theme.addEventListener("click", () => (root.dataset.theme = dark() ? "light" : "dark"));

  // `#selftest` draws everything and reports what has no size or says nothing.
  const selftest = () => {
    document.querySelectorAll("details").forEach((part) => (part.open = true));
    document.querySelectorAll(".pair").forEach((pair) => (pair.hidden = false));
    const flaws = [];
    let boxes = 0;
    for (const shape of document.querySelectorAll("svg polygon, svg polyline, svg path, svg rect, svg text, svg circle")) {
      if (shape.closest("defs")) continue;
      const box = shape.getBBox();
      boxes += 1;
      const flat = shape.tagName === "polyline" || shape.tagName === "polygon" || shape.tagName === "path";
      const seen = flat ? Math.max(box.width, box.height) > 0 || shape.dataset.set : box.width > 0 && box.height > 0;
      const wrong = [...shape.attributes].some((attribute) => /NaN|inf/.test(attribute.value) && attribute.name !== "data-name");
      if (!seen || wrong || ![box.x, box.y, box.width, box.height].every(Number.isFinite)) flaws.push(`no size: ${shape.outerHTML.slice(0, 120)}`);
    }
    let readouts = 0;
    const check = (from, act) => {
      const readout = from.closest("figure").querySelector(".readout");
      readout.textContent = "";
      act();
      readouts += 1;
      if (!/\d/.test(readout.textContent) || /NaN|undefined|Infinity/.test(readout.textContent)) flaws.push(`read-out says "${readout.textContent}": ${from.outerHTML.slice(0, 120)}`);
    };
    const moved = (on, x, y) => on.dispatchEvent(new PointerEvent("pointermove", { bubbles: true, clientX: x, clientY: y }));
    for (const svg of document.querySelectorAll("svg.plot")) {
      const box = svg.getBoundingClientRect();
      check(svg, () => moved(svg, box.left + 0.55 * box.width, box.top + 0.4 * box.height));
      check(svg, () => svg.dispatchEvent(new KeyboardEvent("keydown", { bubbles: true, key: "ArrowRight" })));
    }
    for (const part of document.querySelectorAll(".part, .link, .cell")) {
      check(part, () => part.dispatchEvent(new PointerEvent("pointerover", { bubbles: true })));
    }
    const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth + 1;
    if (wide) flaws.push(`wider than the window: ${document.documentElement.scrollWidth} of ${document.documentElement.clientWidth}`);
    put("selftest", JSON.stringify({ boxes, readouts, requests: performance.getEntriesByType("resource").length, flaws: flaws.slice(0, 20), count: flaws.length }));
  };

  const asked = location.hash.slice(1).split(",");
  if (asked.includes("dark") || asked.includes("light")) root.dataset.theme = asked.find((word) => word === "dark" || word === "light");
  root.dataset.script = "ran";
  if (asked.includes("selftest")) selftest();
  else unfold();
})();
