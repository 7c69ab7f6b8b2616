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

/** From values to pixels: factor · value + from. */
export interface Scale {
  readonly factor: number;
  readonly from: number;
}

/**
 * Draws the rows `first` to `last` (both inclusive) of two columns. null: a gap, the line begins anew behind it;
 * undefined: no sample of this line at that moment, the line goes through.
 */
export function drawLine(
  pen: Pen,
  x: ArrayLike<number>,
  y: ArrayLike<number | null | undefined>,
  first: number,
  last: number,
  toX: Scale,
  toY: Scale,
): void {
  const column = new PixelColumn(new Line(pen));
  // Tens of thousands of samples a frame come through here: numbers at hand, no function a sample more than needed.
  const { factor: factorX, from: fromX } = toX;
  const { factor: factorY, from: fromY } = toY;
  for (let row = first; row <= last; row += 1) {
    const value = y[row];
    if (value === undefined) continue;
    if (value === null) column.break();
    else column.add(factorX * (x[row] as number) + fromX, factorY * value + fromY);
  }
  column.break();
}

/** Gathers the points of one column of pixels. */
class PixelColumn {
  private place = NaN;
  private count = 0;
  private firstX = 0;
  private firstY = 0;
  private lowX = 0;
  private lowY = 0;
  private highX = 0;
  private highY = 0;
  private lastX = 0;
  private lastY = 0;

  constructor(private readonly line: Line) {}

  add(x: number, y: number): void {
    const place = Math.floor(x);
    if (place !== this.place) {
      if (this.count > 0) this.end();
      this.place = place;
      this.firstX = this.lowX = this.highX = x;
      this.firstY = this.lowY = this.highY = y;
    } else if (y < this.lowY) {
      this.lowX = x;
      this.lowY = y;
    } else if (y > this.highY) {
      this.highX = x;
      this.highY = y;
    }
    this.count += 1;
    this.lastX = x;
    this.lastY = y;
  }

  /** The line ends here. */
  break(): void {
    if (this.count > 0) this.end();
    this.place = NaN;
    this.line.end();
  }

  private end(): void {
    const { line, count } = this;
    line.add(this.firstX, this.firstY);
    if (count > 2) {
      const lowIsFirst = this.lowX <= this.highX;
      line.add(lowIsFirst ? this.lowX : this.highX, lowIsFirst ? this.lowY : this.highY);
      line.add(lowIsFirst ? this.highX : this.lowX, lowIsFirst ? this.highY : this.lowY);
    }
    if (count > 1) line.add(this.lastX, this.lastY);
    this.count = 0;
  }
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
    const least = (y - TOLERANCE - this.y0) / way;
    const most = (y + TOLERANCE - this.y0) / way;
    if (least > this.least) this.least = least;
    if (most < this.most) this.most = most;
  }
}
