/**
 * A line through samples with as few points as show it: strokes are the dearest part of a chart, and their cost grows
 * with the number of their points. Pure; everything in pixels of the canvas.
 *
 * Of the samples that share a column of pixels the first, lowest, highest and last remain: no peak is lost. Of what is
 * left those go that lie within `TOLERANCE` of the line between their neighbours.
 */

/** What a line is drawn with; a Path2D. */
export interface Pen {
  moveTo(x: number, y: number): void;
  lineTo(x: number, y: number): void;
}

/** px, vertically: less than what smoothing at the edge of a stroke hides. */
export const TOLERANCE = 0.3;
/** px: points that are nearer than this horizontally lie above each other. */
const ABOVE = 1e-3;

/**
 * Draws the rows `first` to `last` (both inclusive) of two columns. null: a gap, the line begins anew behind it;
 * undefined: no sample of this line at that moment, the line goes through.
 */
export function drawLine(
  pen: Pen,
  x: (row: number) => number,
  y: (row: number) => number | null | undefined,
  first: number,
  last: number,
): void {
  const line = new Line(pen);
  const column = new PixelColumn(line);
  for (let row = first; row <= last; row += 1) {
    const height = y(row);
    if (height === undefined) continue;
    if (height === null) {
      column.end();
      line.end();
    } else {
      column.add(x(row), height);
    }
  }
  column.end();
  line.end();
}

/** Gathers the points of one column of pixels. */
class PixelColumn {
  private place = NaN;
  private count = 0;
  private readonly first = { x: 0, y: 0 };
  private readonly low = { x: 0, y: 0 };
  private readonly high = { x: 0, y: 0 };
  private readonly last = { x: 0, y: 0 };

  constructor(private readonly line: Line) {}

  add(x: number, y: number): void {
    const place = Math.floor(x);
    if (place !== this.place) {
      this.end();
      this.place = place;
    }
    this.count += 1;
    if (this.count === 1) {
      put(this.first, x, y);
      put(this.low, x, y);
      put(this.high, x, y);
    } else if (y < this.low.y) put(this.low, x, y);
    else if (y > this.high.y) put(this.high, x, y);
    put(this.last, x, y);
  }

  end(): void {
    const { first, low, high, last, count } = this;
    this.place = NaN;
    this.count = 0;
    if (count === 0) return;
    this.line.add(first.x, first.y);
    if (count > 2) {
      const [one, other] = low.x <= high.x ? [low, high] : [high, low];
      this.line.add(one.x, one.y);
      this.line.add(other.x, other.y);
    }
    if (count > 1) this.line.add(last.x, last.y);
  }
}

function put(point: { x: number; y: number }, x: number, y: number): void {
  point.x = x;
  point.y = y;
}

/** Leaves out points that the line goes through without them: within the cone from the last one that was drawn. */
class Line {
  private isBegun = false;
  private hasNext = false;
  private x0 = 0;
  private y0 = 0;
  private nextX = 0;
  private nextY = 0;
  private least = -Infinity;
  private most = Infinity;

  constructor(private readonly pen: Pen) {}

  add(x: number, y: number): void {
    if (!this.isBegun) {
      this.pen.moveTo(x, y);
      this.isBegun = true;
      this.anchor(x, y);
      return;
    }
    if (this.hasNext && !this.passes(x, y)) {
      this.pen.lineTo(this.nextX, this.nextY);
      this.anchor(this.nextX, this.nextY);
    }
    this.narrow(x, y);
    this.nextX = x;
    this.nextY = y;
    this.hasNext = true;
  }

  end(): void {
    if (this.hasNext) this.pen.lineTo(this.nextX, this.nextY);
    this.hasNext = this.isBegun = false;
  }

  private anchor(x: number, y: number): void {
    this.x0 = x;
    this.y0 = y;
    this.least = -Infinity;
    this.most = Infinity;
    this.hasNext = false;
  }

  /** Whether a straight line to there passes near all points since the anchor. */
  private passes(x: number, y: number): boolean {
    const way = x - this.x0;
    if (way < ABOVE) return false;
    const slope = (y - this.y0) / way;
    return slope >= this.least && slope <= this.most;
  }

  private narrow(x: number, y: number): void {
    const way = x - this.x0;
    if (way < ABOVE) {
      // Straight up or down: nothing may be left out behind it.
      this.least = Infinity;
      this.most = -Infinity;
      return;
    }
    this.least = Math.max(this.least, (y - TOLERANCE - this.y0) / way);
    this.most = Math.min(this.most, (y + TOLERANCE - this.y0) / way);
  }
}
