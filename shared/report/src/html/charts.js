"use strict";
// Draws CHARTS with uPlot: shared cursor and zoom, limits as shaded areas, dark and light.
const root = document.documentElement;
const dark = matchMedia("(prefers-color-scheme: dark)");
const sync = uPlot.sync("t");
let plots = [];

const variable = (name) => getComputedStyle(root).getPropertyValue(name).trim();
const colorOf = (color) => variable(typeof color === "string" ? "--" + color : "--c" + (color.palette % 7));

function shaded(boxes) {
  return (u) => {
    const { ctx } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    ctx.clip();
    for (const box of boxes) {
      ctx.fillStyle = variable(box.allowed ? "--limit" : "--beyond");
      const left = u.valToPos(box.from, "x", true), right = u.valToPos(box.until, "x", true);
      const top = u.valToPos(box.max, "y", true), bottom = u.valToPos(box.min, "y", true);
      ctx.fillRect(left, top, right - left, bottom - top);
    }
    ctx.restore();
  };
}

// what readers without script see is text to those with it: the same pictures, for a paper
const pictures = new DOMParser().parseFromString(document.getElementById("static").textContent, "text/html").querySelectorAll("svg");

function save(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function exporters(index, title) {
  const name = title.replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "");
  const svg = () => new Blob([new XMLSerializer().serializeToString(pictures[index])], { type: "image/svg+xml" });
  const png = () => {
    const image = new Image();
    image.onload = () => {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [3 * image.width, 3 * image.height];
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((blob) => save(blob, name + ".png"), "image/png");
      URL.revokeObjectURL(image.src);
    };
    image.src = URL.createObjectURL(svg());
  };
  const button = (text, onclick) => Object.assign(document.createElement("button"), { textContent: text, type: "button", className: "save", onclick });
  return [button("SVG", () => save(svg(), name + ".svg")), button("PNG", png)];
}

const DASHES = [undefined, [7, 5], [2, 4], [10, 4, 2, 4]];
let zooming = false;
function zoomAll(u, key) {
  if (key !== "x" || zooming) return;
  zooming = true;
  const { min, max } = u.scales.x;
  for (const other of plots) if (other !== u) other.setScale("x", { min, max });
  zooming = false;
}

function draw() {
  for (const plot of plots) plot.destroy();
  plots = [];
  const host = document.getElementById("charts");
  host.replaceChildren();
  const axis = { stroke: variable("--soft"), grid: { stroke: variable("--line"), width: 1 }, ticks: { stroke: variable("--line"), width: 1 } };
  const format = (value) => (value == null ? "–" : value.toFixed(2));
  for (const [index, chart] of CHARTS.entries()) {
    const box = document.createElement("div");
    box.className = chart.tall ? "chart tall" : "chart";
    const heading = document.createElement("h3");
    heading.append(chart.title + " ");
    heading.append(Object.assign(document.createElement("small"), { textContent: chart.unit }));
    heading.append(...exporters(index, chart.title));
    box.append(heading);
    host.append(box);
    const series = chart.lines.map((line) => ({
      label: line.label,
      stroke: colorOf(line.color),
      width: typeof line.color === "string" ? 1.5 : 2,
      dash: DASHES[line.dash % DASHES.length],
      value: (_, value) => format(value),
      points: { show: false },
    }));
    plots.push(new uPlot({
      width: box.clientWidth - 20,
      height: chart.tall ? 380 : 240,
      cursor: { sync: { key: sync.key }, drag: { x: true, y: false } },
      scales: { x: { time: false } },
      axes: [{ ...axis, values: (_, ticks) => ticks.map((t) => t + " s") }, { ...axis, size: 56 }],
      series: [{ label: "t", value: (_, t) => (t == null ? "–" : t.toFixed(3) + " s") }, ...series],
      hooks: { drawClear: [shaded(chart.boxes)], setScale: [zoomAll] },
    }, [chart.t, ...chart.lines.map((line) => line.y)], box));
  }
}

function theme(isDark) {
  root.classList.toggle("dark", isDark);
  root.classList.toggle("light", !isDark);
  draw();
}

const button = document.getElementById("theme");
button.hidden = false;
button.onclick = () => theme(!root.classList.contains("dark"));
document.getElementById("help").hidden = false;
dark.addEventListener("change", () => theme(dark.matches));
addEventListener("resize", () => {
  for (const plot of plots) plot.setSize({ width: plot.root.parentElement.clientWidth - 20, height: plot.height });
});
theme(dark.matches);
