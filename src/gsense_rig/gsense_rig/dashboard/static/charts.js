// Rolling charts: bins of 50 ms, as the server sends them, drawn by uPlot.

const STEP = 0.05; // s
const SPAN = 30; // s that a chart shows
const KEEP = Math.round(SPAN / STEP) + 20; // bins
const COLOURS = ["#c4600c", "#1b7f4b", "#1f5fa8"];

/** What has come of one trace: bin number -> row. */
export class Series {
  constructor() {
    this.rows = new Map();
    this.newest = -1;
  }

  take(news) {
    if (news.afresh) {
      this.rows.clear();
      this.newest = -1;
    }
    for (const row of news.rows) {
      this.rows.set(row[0], row);
      this.newest = Math.max(this.newest, row[0]);
    }
    for (const bin of this.rows.keys()) {
      if (bin >= this.newest - KEEP) break; // in order of insertion
      this.rows.delete(bin);
    }
  }
}

/** One chart. `lines`: [label, series, column, factor] each; `least`: the smallest height of its y axis. */
export class Chart {
  constructor(place, lines, least) {
    this.place = place;
    this.lines = lines;
    this.data = [[], ...lines.map(() => [])];
    const axis = { stroke: "#66717f", grid: { stroke: "#eceff2", width: 1 }, ticks: { show: false }, font: "11px system-ui" };
    this.plot = new uPlot({
      ...this.size(),
      legend: { show: false },
      cursor: { show: false },
      scales: { x: { time: false, range: [-SPAN, 0] }, y: { range: (_plot, low, high) => range(low, high, least) } },
      axes: [
        { ...axis, size: 22, gap: 2, values: (_plot, ticks) => ticks.map((t) => `${t} s`) },
        { ...axis, size: 46, gap: 4, space: 16 },
      ],
      series: [{}, ...lines.map(([label], i) => ({ label, stroke: COLOURS[lines.length === 3 ? i : 2 * i], width: 1.3, points: { show: false } }))],
    }, this.data, place);
    new ResizeObserver(() => this.plot.setSize(this.size())).observe(place);
  }

  size() {
    return { width: Math.max(120, this.place.clientWidth), height: Math.max(60, this.place.clientHeight) };
  }

  draw() {
    const newest = Math.max(...this.lines.map(([, series]) => series.newest));
    const x = [];
    const columns = this.lines.map(() => []);
    for (let bin = newest - Math.round(SPAN / STEP); bin <= newest; bin++) {
      x.push((bin - newest) * STEP);
      this.lines.forEach(([, series, column, factor], i) => {
        const row = series.rows.get(bin);
        columns[i].push(row === undefined ? null : row[column] * factor);
      });
    }
    this.plot.setData([x, ...columns]);
  }
}

function range(low, high, least) {
  if (low === null || high === null) return [-least / 2, least / 2];
  const middle = (low + high) / 2;
  const half = 1.1 * Math.max((high - low) / 2, least / 2); // no label at the very edge
  return [middle - half, middle + half];
}
