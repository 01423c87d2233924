// Puts charts that one can touch in the place of images: drag to zoom, wheel too, drag
// with shift to pan, click twice to see all again. Without this the images stay.
"use strict";
function touch(figure) {
  const charts = JSON.parse(figure.querySelector("script").textContent);
  const room = document.createElement("div");
  room.className = charts.length > 2 ? "touch many" : "touch";
  const cells = charts.map(() => room.appendChild(document.createElement("div")));
  charts.forEach((chart, k) => cells[k].classList.toggle("row", chart.wide ?? !k));
  const ink = name => getComputedStyle(document.documentElement).getPropertyValue(name);
  // Charts over the same axis move together.
  const syncs = Object.fromEntries(
    charts.map(chart => [chart.x, uPlot.sync(Math.random().toString())]));
  let drawn = [];

  function limits(plot, low, high) {
    for (const each of drawn)
      if (each.axes[0].label === plot.axes[0].label)
        each.setScale("x", {min: low, max: high});
  }

  function moving(plot) {
    const over = plot.over;
    over.addEventListener("wheel", event => {
      event.preventDefault();
      const at = plot.posToVal(event.offsetX, "x"), by = event.deltaY < 0 ? 0.8 : 1.25;
      const {min, max} = plot.scales.x;
      limits(plot, at - (at - min) * by, at + (max - at) * by);
    }, {passive: false});
    over.addEventListener("mousedown", down => {
      if (!down.shiftKey) return;
      down.stopImmediatePropagation();
      const {min, max} = plot.scales.x, from = down.clientX;
      const unit = (max - min) / over.clientWidth;
      const move = event => {
        const shift = (from - event.clientX) * unit;
        limits(plot, min + shift, max + shift);
      };
      const up = () => {
        document.removeEventListener("mousemove", move);
        document.removeEventListener("mouseup", up);
      };
      document.addEventListener("mousemove", move);
      document.addEventListener("mouseup", up);
    }, {capture: true});
  }

  function shown(value) {
    return value == null ? "" : Number(value.toPrecision(5)).toString();
  }

  // What stands at a place of the axis: a number, or one of its names.
  function placed(chart, value) {
    if (!chart.names.length || value == null) return shown(value);
    return chart.names[Math.round(value) - 1] ?? "";
  }

  // An axis of names: level where all of them have room, else upright and some left out.
  function named(chart) {
    const longest = Math.min(26, Math.max(...chart.names.map(name => name.length)));
    const wide = 7 * longest + 12;
    const isLevel = plot => wide * chart.names.length < plot.width - 80;
    return {
      size: plot => isLevel(plot) ? 44 : 40 + 6 * longest,
      rotate: plot => isLevel(plot) ? 0 : -90,
      space: plot => isLevel(plot) ? wide : 16,
      incrs: [1, 2, 5].flatMap(
        n => [0, 1, 2, 3, 4].map(tens => n * 10 ** tens)).sort((a, b) => a - b),
      splits: (_, axis, low, high, step) => {
        const places = [];
        for (let at = step * Math.ceil(low / step); at <= high; at += step)
          places.push(at);
        return places;
      },
      values: (_, places) => places.map(place => placed(chart, place).slice(0, 26)),
    };
  }

  // What y spans, with some room but not beyond where it can be.
  function spanned(chart, low, high) {
    if (isLog(chart, 1)) return uPlot.rangeLog(low, high, 10, true);
    const rules = (chart.rules || []).filter(rule => rule.axis === "y");
    const [least, most] = uPlot.rangeNum(
      Math.min(low ?? 0, ...rules.map(rule => rule.low)),
      Math.max(high ?? 1, ...rules.map(rule => rule.high)), 0.1, true);
    const [floor, roof] = chart.limits;
    return [floor == null ? least : Math.max(least, floor),
      roof == null ? most : Math.min(most, roof)];
  }

  const isLog = (chart, axis) => Boolean((chart.log || [])[axis]);

  // Lines and strips across a chart, below its curves.
  function drawRules(plot, chart) {
    const {ctx, bbox} = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const rule of chart.rules || []) {
      const [from, to] = [rule.low, rule.high].map(v => plot.valToPos(v, rule.axis, true));
      const colour = rule.colour || ink("--ink").trim();
      ctx.fillStyle = colour + hex(rule.opacity ?? 1);
      ctx.strokeStyle = colour;
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
    ctx.restore();
  }

  function drawErrors(plot, chart) {
    const {ctx, bbox} = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = 2 * devicePixelRatio;
    for (const [at, low, high] of chart.errors || []) {
      ctx.strokeStyle = chart.series[at].colour || ink("--ink").trim();
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
    ctx.restore();
  }

  // Both ends of the error bar, behind the value of its point.
  function range(chart, plot, k, row) {
    const bar = (chart.errors || []).find(([at]) => at === k);
    if (!bar) return "";
    const [low, high] = bar.slice(1).map(end => shown(plot.data[end + 1][row]));
    return ` (${low} … ${high})`;
  }

  const isEdge = each => !each.points && each.width === 0;

  // Opacity as two digits behind a colour.
  const hex = share => Math.round(255 * share).toString(16).padStart(2, "0");

  // How strong each band looks, by the place of its upper end: a band lies on the paler
  // ones that were drawn before it.
  function strengths(chart) {
    let clear = 1, before = 0;
    return Object.fromEntries(chart.bands.map(([high, low, strength]) => {
      clear = (strength > before ? clear : 1) * (1 - strength);
      before = strength;
      return [high, 1 - clear];
    }));
  }

  // Bands are as pale as they are drawn, dashed lines hollow.
  function marker(chart, k) {
    const each = chart.series[k], strength = strengths(chart)[k];
    if (each.dashed) return "transparent";
    return each.colour && isEdge(each) && strength
      ? each.colour + hex(strength) : each.colour || ink("--ink").trim();
  }

  // The lower end of each band by its upper one, of those without lines.
  function bandsOf(chart) {
    return Object.fromEntries(chart.bands.filter(([high]) => isEdge(chart.series[high])));
  }

  function sized(chart, which) {
    const width = cells[which].clientWidth;
    return {width: width, height: Math.min(chart.height, 0.9 * width)};
  }

  function draw() {
    for (const plot of drawn) plot.destroy();
    const line = ink("--line"), text = ink("--soft");
    const hue = each => each.colour || ink("--ink").trim();
    drawn = charts.map((chart, which) => {
      const every = charts.filter(each => each.x === chart.x)
        .flatMap(each => [each.data[0][0], each.data[0].at(-1)]);
      const ends = {min: Math.min(...every), max: Math.max(...every)};
      const margin = 0.02 * (ends.max - ends.min), isLogX = isLog(chart, 0);
      const all = isLogX ? [ends.min / 1.1, ends.max * 1.1]
        : chart.names.length ? [0.4, chart.names.length + 0.6]
        : [ends.min - margin, ends.max + margin];
      const band = bandsOf(chart);
      return new uPlot({
      ...sized(chart, which),
      cursor: {sync: {key: syncs[chart.x].key, scales: ["x", null]}, drag: {x: true, y: false}},
      title: chart.title || undefined,
      scales: {x: {time: false, distr: isLogX ? 3 : 1, range: (_, low, high) =>
        low === chart.data[0][0] && high === chart.data[0].at(-1) ? all : [low, high]},
        y: {distr: isLog(chart, 1) ? 3 : 1,
          range: (_, low, high) => spanned(chart, low, high)}},
      legend: {markers: {
        width: (_, k) => !k ? 0 : chart.series[k - 1].dashed ? 2 : isEdge(chart.series[k - 1]) ? 1 : 0,
        dash: (_, k) => k && chart.series[k - 1].dashed ? "dashed" : "solid",
        stroke: (_, k) => k ? hue(chart.series[k - 1]) : "transparent",
        fill: (_, k) => k ? marker(chart, k - 1) : "transparent",
      }},
      axes: [chart.x, chart.y].map(label => ({
        label: label, stroke: text, grid: {stroke: line, width: 1},
        show: label === chart.x || chart.ticks !== false,
        ticks: {stroke: line, width: 1}, size: label === chart.y ? 62 : 44,
        ...(label === chart.x && chart.names.length
          ? named(chart) : {values: (_, places) => places.map(shown)}),
      })),
      series: [{label: chart.x, value: (_, value) => placed(chart, value)}].concat(
        chart.series.map((each, k) => ({
          label: k in band ? each.label.replace(/, [^,]*( \[[^\]]*\])$/, "$1") : each.label,
          stroke: hue(each), width: each.points ? 0 : each.width,
          dash: each.dashed ? [3, 4] : undefined,
          paths: each.points ? () => null : undefined,
          points: {show: each.points, size: 6, fill: hue(each), width: 0},
          value: (plot, value, _, row) => k in band && value != null
            ? shown(plot.data[band[k] + 1][row]) + " … " + shown(value)
            : value == null ? "" : shown(value) + range(chart, plot, k, row),
        }))),
      bands: chart.bands.map(([high, low, strength]) => ({
        series: [high + 1, low + 1],
        fill: chart.series[high].colour + hex(strength),
      })),
      hooks: {ready: [moving], drawAxes: [plot => drawRules(plot, chart)],
        draw: [plot => drawErrors(plot, chart)]},
    }, chart.data, cells[which]); });
    drawn.forEach((plot, which) => {
      syncs[charts[which].x].sub(plot);
      // Both ends of a band share a line; bands of several curves would fill the page.
      const {series} = charts[which], band = bandsOf(charts[which]);
      const many = Object.keys(band).filter(k => series[k].label).length > 4;
      const rows = plot.root.querySelectorAll(".u-legend .u-series");
      series.forEach((each, k) => {
        if (!each.label || isEdge(each) && (many || !(k in band)))
          rows[k + 1].style.display = "none";
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
