/**
 * Parts of a layout that stand by themselves: bands below one another, in each columns beside one another. No panel
 * reaches over a border, so a panel that grows moves what is below it in its column, and stretches nothing beside it.
 * Pure.
 */

import type { Place } from './layout';

/** Panels of one part as they are read, with its place in the grid. */
export interface Part<Panel extends Place> extends Place {
  panels: readonly Panel[];
}

/** The bands of a layout from its upper edge on, each as its columns from left to right. */
export function partsOf<Panel extends Place>(panels: readonly Panel[]): Part<Panel>[][] {
  let top = 0;
  return apart(panels, 'y', 'h').map((band) => {
    const bottom = Math.max(...band.map((one) => one.y + one.h));
    const [y, h] = [top, bottom - top]; // rows that are left free belong to the band below them
    top = bottom;
    return apart(band, 'x', 'w').map((column) => {
      const x = Math.min(...column.map((one) => one.x));
      const w = Math.max(...column.map((one) => one.x + one.w)) - x;
      return { x, y, w, h, panels: column.toSorted((one, other) => one.y - other.y || one.x - other.x) };
    });
  });
}

/** Groups of panels between which a straight line can be drawn, in the order of `at`. */
function apart<Panel extends Place>(panels: readonly Panel[], at: 'x' | 'y', size: 'w' | 'h'): Panel[][] {
  const found: Panel[][] = [];
  let end = -Infinity;
  for (const one of panels.toSorted((first, second) => first[at] - second[at])) {
    if (one[at] < end) found.at(-1)!.push(one);
    else found.push([one]);
    end = Math.max(end, one[at] + one[size]);
  }
  return found;
}
