// Replaces images by interactive charts: drag to zoom, double-click to see all.
"use strict";
function touch(figure) {
  const charts = JSON.parse(figure.querySelector("script").textContent);
  const room = document.createElement("div");
  room.className = charts.length > 2 ? "touch many" : "touch";
  const cells = charts.map(() => room.appendChild(document.createElement("div")));
  charts.forEach((chart, k) => cells[k].classList.toggle("row", chart.wide));
  const ink = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const hue = each => each.colour || ink("--ink");
  // Opacity as two digits after a colour.
  const hex = share => Math.round(255 * share).toString(16).padStart(2, "0");
  const shown = value => value == null ? "" : Number(value.toPrecision(5)).toString();
  const isEdge = each => !each.points && each.width === 0;
  // Charts with the same axis zoom together.
  const syncs = Object.fromEntries(
    charts.map(chart => [chart.x, uPlot.sync(Math.random().toString())]));
  let drawn = [];

  // Range of y with some margin, within its limits.
  function spanned(chart, low, high) {
    if (chart.log[1]) return uPlot.rangeLog(low, high, 10, true);
    const rules = chart.rules.filter(rule => rule.axis === "y");
    const [least, most] = uPlot.rangeNum(
      Math.min(low ?? 0, ...rules.map(rule => rule.low)),
      Math.max(high ?? 1, ...rules.map(rule => rule.high)), 0.1, true);
    const [floor, roof] = chart.limits;
    return [floor == null ? least : Math.max(least, floor),
      roof == null ? most : Math.min(most, roof)];
  }

  // Draws within the axes of a plot.
  function clipped(plot, draw) {
    const {ctx, bbox} = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    draw(ctx, bbox);
    ctx.restore();
  }

  // Rules and spans, below the curves.
  const drawRules = (plot, chart) => clipped(plot, (ctx, bbox) => {
    for (const rule of chart.rules) {
      const [from, to] = [rule.low, rule.high].map(v => plot.valToPos(v, rule.axis, true));
      ctx.fillStyle = hue(rule) + hex(rule.opacity ?? 1);
      ctx.strokeStyle = hue(rule);
      ctx.setLineDash(rule.dashed ? [8, 6] : []);
      ctx.beginPath();
      if (rule.opacity !== undefined) {
        if (rule.axis === "x") ctx.fillRect(from, bbox.top, to - from, bbox.height);
        else ctx.fillRect(bbox.left, from, bbox.width, to - from);
      } else {
        ctx.moveTo(...(rule.axis === "x" ? [from, bbox.top] : [bbox.left, from]));
        ctx.lineTo(...(rule.axis === "x"
          ? [from, bbox.top + bbox.height] : [bbox.left + bbox.width, from]));
        ctx.stroke();
      }
    }
  });

  const drawErrors = (plot, chart) => clipped(plot, ctx => {
    ctx.lineWidth = 2 * devicePixelRatio;
    for (const [at, low, high] of chart.errors) {
      ctx.strokeStyle = hue(chart.series[at]);
      ctx.beginPath();
      plot.data[0].forEach((x, row) => {
        const ends = [low, high].map(k => plot.data[k + 1][row]);
        if (ends.some(end => end == null)) return;
        const place = plot.valToPos(x, "x", true);
        ctx.moveTo(place, plot.valToPos(ends[0], "y", true));
        ctx.lineTo(place, plot.valToPos(ends[1], "y", true));
      });
      ctx.stroke();
    }
  });

  // What the legend shows at the pointer: a value, the ends of a band or error bar.
  function valued(chart, plot, value, k, row) {
    if (value == null) return "";
    const ends = (low, high) => [low, high].map(end => shown(plot.data[end + 1][row])).join(" … ");
    const band = chart.bands.find(([high]) => high === k);
    if (band) return ends(band[1], k);
    const bar = chart.errors.find(([at]) => at === k);
    return bar ? `${shown(value)} (${ends(bar[1], bar[2])})` : shown(value);
  }

  function filled(chart, k) {
    const each = chart.series[k], band = chart.bands.find(([high]) => high === k);
    return each.dashed ? "transparent" : band ? each.colour + hex(band[2]) : hue(each);
  }

  function sized(chart, which) {
    const width = cells[which].clientWidth;
    return {width: width, height: Math.min(chart.height, 0.9 * width)};
  }

  function options(chart, which) {
    const every = charts.filter(each => each.x === chart.x)
      .flatMap(each => [each.data[0][0], each.data[0].at(-1)]);
    const low = Math.min(...every), high = Math.max(...every), margin = 0.02 * (high - low);
    const all = chart.log[0] ? [low / 1.1, high * 1.1] : [low - margin, high + margin];
    const [first, last] = [chart.data[0][0], chart.data[0].at(-1)];
    const dashed = k => k && chart.series[k - 1].dashed;
    return {
      ...sized(chart, which),
      cursor: {sync: {key: syncs[chart.x].key, scales: ["x", null]}, drag: {x: true, y: false}},
      title: chart.title || undefined,
      scales: {
        x: {time: false, distr: chart.log[0] ? 3 : 1,
          range: (_, from, to) => from === first && to === last ? all : [from, to]},
        y: {distr: chart.log[1] ? 3 : 1, range: (_, from, to) => spanned(chart, from, to)},
      },
      legend: {markers: {
        width: (_, k) => !k ? 0 : dashed(k) ? 2 : isEdge(chart.series[k - 1]) ? 1 : 0,
        dash: (_, k) => dashed(k) ? "dashed" : "solid",
        stroke: (_, k) => k ? hue(chart.series[k - 1]) : "transparent",
        fill: (_, k) => k ? filled(chart, k - 1) : "transparent",
      }},
      axes: [chart.x, chart.y].map((label, k) => ({
        label: label, stroke: ink("--soft"), grid: {stroke: ink("--line"), width: 1},
        ticks: {stroke: ink("--line"), width: 1}, size: k ? 62 : 44,
        values: (_, places) => places.map(shown),
      })),
      series: [{label: chart.x, value: (_, value) => shown(value)}].concat(
        chart.series.map((each, k) => ({
          label: each.label, stroke: hue(each), width: each.points ? 0 : each.width,
          dash: each.dashed ? [3, 4] : undefined,
          paths: each.points ? () => null : undefined,
          points: {show: each.points, size: 6, fill: hue(each), width: 0},
          value: (plot, value, _, row) => valued(chart, plot, value, k, row),
        }))),
      bands: chart.bands.map(([high, low, share]) => ({
        series: [high + 1, low + 1], fill: chart.series[high].colour + hex(share),
      })),
      hooks: {drawAxes: [plot => drawRules(plot, chart)], draw: [plot => drawErrors(plot, chart)]},
    };
  }

  function draw() {
    for (const plot of drawn) plot.destroy();
    drawn = charts.map((chart, k) => new uPlot(options(chart, k), chart.data, cells[k]));
    drawn.forEach((plot, which) => {
      syncs[charts[which].x].sub(plot);
      // The legends of many bands would fill the page.
      const {series, bands} = charts[which];
      const many = bands.filter(([high]) => series[high].label).length > 4;
      const rows = plot.root.querySelectorAll(".u-legend .u-series");
      series.forEach((each, k) => {
        if (!each.label || many && isEdge(each)) rows[k + 1].style.display = "none";
      });
    });
  }

  figure.querySelector("img").after(room);
  figure.classList.add("touched");
  draw();
  new ResizeObserver(() => {
    drawn.forEach((plot, which) => plot.setSize(sized(charts[which], which)));
  }).observe(room);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}
for (const figure of document.querySelectorAll("figure[data-touch]")) touch(figure);
