/** Lines for uPlot with no more points than show them (`line.ts`). */

import uPlot from 'uplot';
import { DashedPen } from './dashes';
import { drawLine, type Scale } from './line';

type Values = ArrayLike<number | null | undefined>;

/** A series' line, in the place of uPlot's own, with dashes of so many px if any. Horizontal x-axis only. */
export const sparingPath =
  (dashes?: readonly number[]): uPlot.Series.PathBuilder =>
  (plot, series, first, last) => {
    const stroke = new Path2D();
    const pen = dashes
      ? new DashedPen(
          stroke,
          dashes.map((length) => length * devicePixelRatio),
        )
      : stroke;
    uPlot.orient(plot, series, (_, dataX, dataY, scaleX, scaleY, toX, toY, left, top, width, height) => {
      const [x, placeX] = placed(dataX, scaleX, (value) => toX(value, scaleX, width, left));
      const [y, placeY] = placed(dataY, scaleY, (value) => toY(value, scaleY, height, top));
      drawLine(pen, x as ArrayLike<number>, y, first, last, placeX, placeY);
    });
    return { stroke, fill: null, clip: null, band: null, gaps: [], flags: 1 };
  };

/** Values and how they become pixels: as they are where the scale is linear, else as pixels already. */
function placed(values: Values, scale: uPlot.Scale, ask: (value: number) => number): [Values, Scale] {
  const { min, max } = scale;
  if (scale.distr === 3 || min == null || max == null || max === min) {
    return [Array.from(values, (value) => (value == null ? value : ask(value))), { factor: 1, from: 0 }];
  }
  const factor = (ask(max) - ask(min)) / (max - min);
  return [values, { factor, from: ask(min) - factor * min }];
}
