/** What a chart is made of, and how it is turned into uPlot's options. The component only draws it. */

import uPlot from 'uplot';
import { placedFlags } from './chart_flags';
import { fixed, NOTHING, significant } from './format';
import { sparingPath } from './drawing/paths';

export interface ChartSeries {
  label: string;
  /** A CSS colour; for joints `jointColour(joint)`. */
  colour: string;
  /** Lengths of dashes and gaps in px; a full line without. */
  dash?: number[];
  width?: number;
  /** Written at the right end of the line, so that colour is not its only sign. */
  end?: string;
  /** Draw points only: measured values without order. */
  points?: boolean;
  show?: boolean;
}

export interface ChartMarker {
  x: number;
  label: string;
  /** `warn`: a limit; `plain`: a ramp begins; `tick`: a diamond at the foot, without a name: a retry. */
  tone?: 'plain' | 'warn' | 'bad' | 'tick';
}

export interface ChartColours {
  ink: string;
  soft: string;
  grid: string;
  warn: string;
  bad: string;
  surface: string;
  font: string;
}

export interface ChartAxes {
  /** How a value of the x-axis is written; numbers as they are without. */
  x?: (value: number) => string;
  y?: (value: number) => string;
  /** Fixed places on the x-axis, given what is shown. */
  splits?: (low: number, high: number) => number[];
  logX?: boolean;
  logY?: boolean;
}

export interface ChartDrawing {
  series: readonly ChartSeries[];
  axes: ChartAxes;
  colours: ChartColours;
  markers: () => readonly ChartMarker[];
  /** A fixed range; what the data needs without. */
  xRange: () => [number, number] | null;
  yRange: () => [number, number] | null;
  /** The least that the y-axis spans. */
  least: number;
  /** Lines of one pixel: a processor strokes those ten times as fast as wider ones. */
  thin: boolean;
  /** Charts of the same key share their cursor and their zoom. */
  sync?: string;
  /** Whether what lies at the cursor is written below. */
  readout: boolean;
  zoomable: boolean;
  zoomed: (range: [number, number]) => void;
  cursorAt: (x: number | null) => void;
}

const AXIS_FONT_SIZE = 12;
/** px above a chart that has marks: their names stand there, and cover no curve. */
const FLAGS = 20;
/** px from the end of a line to its name: room for what joins them where the name had to move away. */
const LEADER = 12;

/** Room below and above what the data needs, so that no line runs along the edge. */
export function padded(low: number, high: number, least = 0): [number, number] {
  if (!Number.isFinite(low) || !Number.isFinite(high)) return [-1, 1];
  const span = Math.max(high - low, least, 1e-9);
  const middle = (low + high) / 2;
  return [middle - span * 0.56, middle + span * 0.56];
}

/** The power of ten below: numbers at a logarithmic axis are counted from its lower end. */
const decade = (value: number): number => 10 ** Math.floor(Math.log10(value));

const PLAIN = new Intl.NumberFormat('en-GB', { maximumFractionDigits: 9 });

/** px between two numbers of the vertical axis: low charts would have one alone, which is no scale. */
const ROOM_OF_A_NUMBER = 20;

/** A number at an axis: with a true minus sign, as everywhere. */
function plain(value: number): string {
  return PLAIN.format(value).replace('-', '−');
}

export function optionsOf(drawing: ChartDrawing, width: number, height: number): uPlot.Options {
  const { colours, axes } = drawing;
  const font = `${AXIS_FONT_SIZE}px ${colours.font}`;
  const axis: uPlot.Axis = {
    font,
    stroke: colours.soft,
    grid: { stroke: colours.grid, width: 1 },
    ticks: { show: false },
  };
  const written = (write: (value: number) => string = plain) => ({
    values: (_: uPlot, values: (number | null)[]) =>
      values.map((value) => (value === null ? '' : write(value))),
  });
  const places = axes.splits;
  const isMarked = drawing.sync !== undefined || drawing.markers().length > 0;
  return {
    width,
    height,
    padding: [isMarked ? FLAGS : 8, drawing.series.some((one) => one.end) ? LEADER + 26 : 10, 0, 0],
    legend: { show: drawing.readout },
    cursor: {
      drag: { x: drawing.zoomable, y: false, setScale: false },
      points: { size: 7 },
      y: drawing.sync === undefined, // its height means nothing in the other charts
      ...(drawing.sync === undefined ? {} : { sync: { key: drawing.sync } }),
    },
    scales: {
      x: { time: false, distr: axes.logX ? 3 : 1, range: (_, low, high) => drawing.xRange() ?? [low, high] },
      y: {
        distr: axes.logY ? 3 : 1,
        range: (_, low, high) =>
          drawing.yRange() ?? (axes.logY ? [decade(low), high] : padded(low, high, drawing.least)),
      },
    },
    axes: [
      {
        ...axis,
        size: 26,
        gap: 4,
        ...written(axes.x),
        ...(places === undefined
          ? {}
          : { splits: (plot, __, low, high) => withRoom(places(low, high), plot.width) }),
      },
      {
        ...axis,
        size: 56,
        gap: 6,
        space: ROOM_OF_A_NUMBER,
        ...written(axes.y ?? (axes.logY ? (value) => significant(value, 1) : plain)),
      },
    ],
    series: [
      { label: 'at', value: (_, value) => (value == null ? NOTHING : (axes.x ?? plain)(value)) },
      ...drawing.series.map((one) => ({
        label: one.label,
        stroke: one.colour,
        width: one.points ? 0 : drawing.thin ? 1 : (one.width ?? 1.75),
        ...(one.points ? {} : { paths: sparingPath(one.dash) }),
        value: (_: uPlot, value: number | null) => (value == null ? NOTHING : fixed(value, 2)),
        show: one.show ?? true,
        points: one.points ? { show: true, size: 4, fill: one.colour } : { show: false },
      })),
    ],
    hooks: {
      draw: [(plot) => drawMarkers(plot, drawing), (plot) => drawEnds(plot, drawing)],
      setSelect: [(plot) => select(plot, drawing)],
      setCursor: [
        (plot) =>
          drawing.cursorAt(plot.cursor.idx == null ? null : plot.posToVal(plot.cursor.left ?? 0, 'x')),
      ],
    },
  };
}

/** px that a time at the axis needs: -30 s, and some room. */
const LABEL_WIDTH = 52;

/** Every second, every third … of `places`, the last one among them, where all would cover each other in `width` px. */
export function withRoom(places: readonly number[], width: number): number[] {
  const every = Math.max(1, Math.ceil((places.length * LABEL_WIDTH) / Math.max(1, width - 2 * LABEL_WIDTH)));
  return places.filter((_, index) => (places.length - 1 - index) % every === 0);
}

function select(plot: uPlot, drawing: ChartDrawing): void {
  if (plot.select.width < 8) return;
  drawing.zoomed([
    plot.posToVal(plot.select.left, 'x'),
    plot.posToVal(plot.select.left + plot.select.width, 'x'),
  ]);
  plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
}

/** Which names are written first where there is not room for all; cursors are `warn`. */
const RANKS = { bad: 0, warn: 1, plain: 2, tick: 3 } as const;

/** Vertical lines with a flag, the names in words: colour is not their only sign. */
function drawMarkers(plot: uPlot, drawing: ChartDrawing): void {
  const { ctx, bbox } = plot;
  const ratio = devicePixelRatio;
  const { min = -Infinity, max = Infinity } = plot.scales['x'] ?? {};
  ctx.save();
  ctx.font = `${11 * ratio}px ${drawing.colours.font}`;
  ctx.textBaseline = 'top';
  ctx.textAlign = 'left';
  const { soft, warn, bad } = drawing.colours;
  const colours = { plain: soft, tick: soft, warn, bad };
  const marks = drawing
    .markers()
    .filter((marker) => marker.x >= min && marker.x <= max)
    .map(({ x, label, tone = 'plain' }) => ({
      x: Math.round(plot.valToPos(x, 'x', true)),
      label,
      tone,
      rank: RANKS[tone],
    }));
  for (const { x, tone } of marks) {
    ctx.strokeStyle = ctx.fillStyle = colours[tone];
    if (tone === 'tick') {
      // A shape of its own: a stroke would be taken for one of the axis.
      const [foot, half] = [bbox.top + bbox.height, 4 * ratio];
      ctx.fill(new Path2D(`M${x - half} ${foot - half}l${half} ${-half} ${half} ${half} ${-half} ${half}z`));
      continue;
    }
    ctx.lineWidth = ratio;
    ctx.setLineDash(tone === 'plain' ? [2 * ratio, 3 * ratio] : []);
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
  }
  const room = {
    left: bbox.left,
    right: bbox.left + bbox.width,
    gap: 4 * ratio,
    width: (text: string) => ctx.measureText(text).width,
  };
  ctx.setLineDash([]);
  for (const { left, text, index } of placedFlags(marks, room)) {
    const { x, tone } = marks[index]!;
    ctx.fillStyle = ctx.strokeStyle = colours[tone];
    if (tone !== 'tick') {
      // Its line goes up to its name: lines that have none end below, so none seems to have the name beside it.
      ctx.beginPath();
      ctx.moveTo(x, bbox.top - 14 * ratio);
      ctx.lineTo(x, bbox.top);
      ctx.stroke();
    }
    ctx.fillText(text, left, bbox.top - 14 * ratio);
  }
  ctx.restore();
}

/** Names at the right end of lines: moved apart where they would cover each other, and joined to their lines then. */
function drawEnds(plot: uPlot, drawing: ChartDrawing): void {
  const { ctx, bbox } = plot;
  const ratio = devicePixelRatio;
  const ends: { y: number; text: string; colour: string }[] = [];
  drawing.series.forEach((one, index) => {
    if (one.end === undefined || plot.series[index + 1]?.show === false) return;
    const last = lastValue(plot.data[index + 1] as ArrayLike<number | null> | undefined, lastShown(plot));
    if (last !== null) ends.push({ y: plot.valToPos(last, 'y', true), text: one.end, colour: one.colour });
  });
  const places = apart(
    ends.map((end) => end.y),
    13 * ratio,
    bbox.top,
    bbox.top + bbox.height,
  );
  ctx.save();
  ctx.font = `600 ${11 * ratio}px ${drawing.colours.font}`;
  ctx.textBaseline = 'middle';
  ctx.textAlign = 'left';
  const right = bbox.left + bbox.width;
  ctx.lineWidth = ratio;
  ends.forEach((end, index) => {
    const y = places[index] ?? end.y;
    ctx.fillStyle = ctx.strokeStyle = end.colour;
    ctx.beginPath();
    ctx.moveTo(right + ratio, end.y);
    ctx.lineTo(right + (LEADER - 2) * ratio, y);
    ctx.stroke();
    ctx.fillText(end.text, right + LEADER * ratio, y);
  });
  ctx.restore();
}

/**
 * Places near `wanted`, at least `distance` apart and within [low, high] if there is room: those that would cover each
 * other stand about the middle of their lines, so that none is further from its own than it has to be. In the order of
 * height; those that are nearly as high stay in the order given, so that noise does not make them change places.
 */
export function apart(wanted: readonly number[], distance: number, low: number, high: number): number[] {
  const step = (index: number): number => Math.round((wanted[index] ?? 0) / distance);
  const order = wanted.map((_, index) => index).sort((one, other) => step(one) - step(other) || one - other);
  const stacks: { members: number[]; top: number }[] = [];
  const stacked = (members: number[]): { members: number[]; top: number } => {
    const height = (members.length - 1) * distance;
    const middle = members.reduce((sum, index) => sum + (wanted[index] ?? 0), 0) / members.length;
    return { members, top: Math.max(low, Math.min(high - height, middle - height / 2)) };
  };
  for (const index of order) {
    let last = stacked([index]);
    for (let before = stacks.at(-1); before !== undefined; before = stacks.at(-1)) {
      if (before.top + before.members.length * distance <= last.top) break;
      stacks.pop();
      last = stacked([...before.members, ...last.members]);
    }
    stacks.push(last);
  }
  const places = [...wanted];
  for (const { members, top } of stacks)
    members.forEach((index, place) => (places[index] = top + place * distance));
  return places;
}

/** The last row that is in the picture. */
function lastShown(plot: uPlot): number {
  const time = plot.data[0];
  const high = plot.scales['x']?.max ?? Infinity;
  let row = time.length - 1;
  while (row > 0 && (time[row] as number) > high) row -= 1;
  return row;
}

function lastValue(column: ArrayLike<number | null> | undefined, from: number): number | null {
  for (let row = from; row >= 0; row -= 1) {
    const value = column?.[row] ?? null;
    if (value !== null) return value;
  }
  return null;
}
