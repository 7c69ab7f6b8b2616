/** Lines for uPlot with no more points than show them (`line.ts`). */

import uPlot from 'uplot';
import { drawLine } from './line';

/** A series' line, in the place of uPlot's own. Horizontal x-axis only. */
export const sparingPath: uPlot.Series.PathBuilder = (plot, series, first, last) => {
  const stroke = new Path2D();
  uPlot.orient(plot, series, (_, dataX, dataY, scaleX, scaleY, toX, toY, left, top, width, height) => {
    const x = placing(scaleX, (value) => toX(value, scaleX, width, left));
    const y = placing(scaleY, (value) => toY(value, scaleY, height, top));
    drawLine(
      stroke,
      (row) => x(dataX[row] as number),
      (row) => {
        const value = dataY[row];
        return value === null || value === undefined ? value : y(value);
      },
      first,
      last,
    );
  });
  return { stroke, fill: null, clip: null, band: null, gaps: [], flags: 1 };
};

/** From values to pixels; where the scale is linear, without asking uPlot for every value. */
function placing(scale: uPlot.Scale, ask: (value: number) => number): (value: number) => number {
  const { min, max } = scale;
  if (scale.distr === 3 || min == null || max == null || max === min) return ask;
  const from = ask(min);
  const factor = (ask(max) - from) / (max - min);
  return (value) => from + factor * (value - min);
}
