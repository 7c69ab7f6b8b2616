/** Means in bins with their deviations, as points of a small plot. */

export interface BinnedPoint {
  /** 0 to 1, y downwards. */
  x: number;
  y: number;
  low: number;
  high: number;
}

export interface BinnedPlot {
  points: BinnedPoint[];
  /** Where zero lies, y downwards; null where it is not shown. */
  zero: number | null;
  left: number;
  right: number;
  bottom: number;
  top: number;
}

/** Bins without a value are left out. Null where fewer than two are left. `range`: of values, for plots side by side. */
export function binnedPlot(
  centres: readonly number[],
  values: readonly (number | null)[],
  deviations: readonly (number | null)[],
  range: readonly [number, number] | null = null,
): BinnedPlot | null {
  const kept = centres.flatMap((centre, index) => {
    const value = values[index] ?? null;
    return value === null ? [] : [{ centre, value, deviation: deviations[index] ?? 0 }];
  });
  if (kept.length < 2) return null;
  const [bottom, top] = range ?? rangeOf([{ values, deviations }]);
  const left = Math.min(...kept.map((one) => one.centre));
  const right = Math.max(...kept.map((one) => one.centre));
  const x = (centre: number): number => (right > left ? (centre - left) / (right - left) : 0.5);
  const y = (value: number): number => 1 - (value - bottom) / (top - bottom || 1);
  return {
    points: kept.map((one) => ({
      x: x(one.centre),
      y: y(one.value),
      low: y(one.value - one.deviation),
      high: y(one.value + one.deviation),
    })),
    zero: bottom <= 0 && top >= 0 ? y(0) : null,
    left,
    right,
    bottom,
    top,
  };
}

interface Bins {
  values: readonly (number | null)[];
  deviations: readonly (number | null)[];
}

/** What several plots need together, with zero in it and a little room. */
export function rangeOf(plots: readonly Bins[]): [number, number] {
  const ends = plots.flatMap((plot) =>
    plot.values.flatMap((value, index) =>
      value === null ? [] : [value - (plot.deviations[index] ?? 0), value + (plot.deviations[index] ?? 0)],
    ),
  );
  const low = Math.min(0, ...ends);
  const high = Math.max(0, ...ends);
  const room = 0.06 * (high - low || 1);
  return [low - room, high + room];
}
