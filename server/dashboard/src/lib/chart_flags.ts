/**
 * Which marks of a chart have their names written, and where. A stop must not be without its word because something of
 * less weight stands before it: the weightiest are placed first. Pure; x in px of the canvas.
 */

export interface Flag {
  x: number;
  label: string;
  /** 0 is placed first; of the same rank the one that was named first. */
  rank: number;
}

export interface PlacedFlag {
  /** Where the text begins. */
  left: number;
  text: string;
  /** Place among the flags that were given. */
  index: number;
}

export interface FlagRoom {
  left: number;
  right: number;
  /** From a mark to its text, and from one text to the next. */
  gap: number;
  /** Width of a text. */
  width: (text: string) => number;
}

export function placedFlags(flags: readonly Flag[], room: FlagRoom): PlacedFlag[] {
  const placed: (PlacedFlag & { end: number })[] = [];
  for (const run of runsOf(flags, room).sort(
    (one, other) => one.rank - other.rank || one.index - other.index,
  )) {
    const wide = room.width(run.text);
    const free = (left: number): boolean =>
      left >= room.left &&
      left + wide <= room.right &&
      placed.every((one) => left >= one.end + room.gap || left + wide + room.gap <= one.left);
    // On the left of its mark only where there is no place on the right: at the edge, or beside another name.
    const left = [run.x + room.gap, run.x - room.gap - wide].find(free);
    if (left !== undefined) placed.push({ left, text: run.text, index: run.index, end: left + wide });
  }
  return placed
    .sort((one, other) => one.left - other.left)
    .map(({ left, text, index }) => ({ left, text, index }));
}

type Run = Flag & { index: number; text: string };

/** Marks of the same name that stand too close for two words: one word, with their number. */
function runsOf(flags: readonly Flag[], room: FlagRoom): Run[] {
  const runs: Run[] = [];
  const last = new Map<string, { run: Run; x: number; count: number }>();
  const inOrder = flags
    .map((flag, index) => ({ ...flag, index, text: flag.label }))
    .filter((flag) => flag.label !== '')
    .sort((one, other) => one.x - other.x);
  for (const flag of inOrder) {
    const before = last.get(flag.label);
    if (before !== undefined && flag.x - before.x < room.width(`${flag.label} ×9`) + 2 * room.gap) {
      before.count += 1;
      before.x = flag.x;
      before.run.text = `${flag.label} ×${before.count}`;
    } else {
      last.set(flag.label, { run: flag, x: flag.x, count: 1 });
      runs.push(flag);
    }
  }
  return runs;
}
