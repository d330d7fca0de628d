"use strict";
// Percentile curves and histograms of the paths picked.
const colors = ["#1f6fd1", "#d95f02", "#1b9e77", "#8a56c8", "#c22f6b", "#8a7a00", "#556677"];
const first = new Set(["pipe", "wake-up control_computer", "arm to D/A"]);
const pick = document.getElementById("pick");
const boxes = CURVES.map((curve) => {
  const label = document.createElement("label");
  const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: first.has(curve.path) });
  box.onchange = draw;
  label.append(box, " " + curve.path);
  pick.append(label);
  return box;
});

const tails = [];
for (let tail = 1; tail <= 1e6; tail *= 1.1) tails.push(tail);
function percentiles({ buckets }) {
  const n = buckets.reduce((sum, [, count]) => sum + count, 0);
  let seen = 0, i = 0;
  return tails.map((tail) => {
    if (tail > n * 1.1) return null;
    const wanted = Math.max(1, Math.ceil(n * (1 - 1 / tail)));
    while (i < buckets.length && seen + buckets[i][1] < wanted) seen += buckets[i++][1];
    return buckets[Math.min(i, buckets.length - 1)][0] / 1000;
  });
}

const OCTAVE = 4;
const bins = Array.from({ length: 30 * OCTAVE }, (_, i) => 0.1 * 2 ** (i / OCTAVE));
function histogram({ buckets }) {
  const counts = bins.map(() => null);
  for (const [ns, count] of buckets) {
    const bin = Math.min(bins.length - 1, Math.max(0, Math.floor(OCTAVE * Math.log2(ns / 100))));
    counts[bin] = (counts[bin] || 0) + count;
  }
  return counts;
}

let plots = [];
function plot(id, x, xs, y, curves, path) {
  const host = document.getElementById(id);
  const soft = getComputedStyle(document.documentElement).getPropertyValue("--soft");
  const line = getComputedStyle(document.documentElement).getPropertyValue("--line");
  const axis = { stroke: soft, grid: { stroke: line, width: 1 }, ticks: { stroke: line, width: 1 } };
  const used = xs.map((_, i) => curves.some((curve) => curve.values[i] != null));
  const from = used.indexOf(true), until = used.lastIndexOf(true) + 1;
  plots.push(new uPlot({
    width: host.clientWidth, height: 380,
    scales: { x: { time: false, distr: 3 }, y: { distr: 3 } },
    axes: [{ ...axis }, { ...axis, size: 70 }],
    series: [{ label: x }, ...curves.map((curve) => ({
      label: curve.path + y, stroke: colors[curve.color % colors.length], width: 2, points: { show: false }, paths: path,
    }))],
  }, [xs.slice(from, until), ...curves.map((curve) => curve.values.slice(from, until))], host));
}

function draw() {
  for (const old of plots) old.destroy();
  plots = [];
  const picked = CURVES.filter((_, i) => boxes[i].checked).map((curve, color) => ({ ...curve, color }));
  if (!picked.length) return;
  const of = (values) => picked.map((curve) => ({ ...curve, values: values(curve) }));
  plot("percentiles", "1 / (1 − quantile)", tails, ", µs", of(percentiles));
  plot("histogram", "µs", bins, "", of(histogram), uPlot.paths.stepped({ align: 1 }));
}
addEventListener("resize", draw);
draw();
