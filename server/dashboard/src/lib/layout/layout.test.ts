import { expect, it } from 'vitest';
import {
  COLUMNS,
  FORMAT,
  layoutOf,
  movedInOrder,
  packed,
  addedPanel,
  STANDARD,
  unpacked,
  within,
  written,
  type Layout,
} from './layout';

const bare = (layout: Layout) => layout.panels.map(({ id: _, ...panel }) => panel);

it('comes back from a file and from a link as it was, with ids of its own', async () => {
  const notes = addedPanel(STANDARD.panels, 'notes', { text: 'payload 2 kg, °C – "quoted" <b>' });
  // Beside the link's, not below it; a second one beside the first.
  expect(notes).toMatchObject({ x: 0, y: 18 });
  expect(addedPanel([...STANDARD.panels, notes], 'camera')).toMatchObject({ x: 4, y: 18 });
  const layout = { name: 'Bench', panels: [...STANDARD.panels, notes, addedPanel([], 'number')] };
  for (const back of [layoutOf(written(layout)), await unpacked(await packed(layout))]) {
    expect(back.name).toBe('Bench');
    expect(bare(back)).toEqual(bare(layout));
    expect(new Set(back.panels.map((one) => one.id)).size).toBe(layout.panels.length);
  }
  expect(await packed(layout)).toMatch(/^[\w-]+$/);
});

it('of the standard layout no panel covers another or leaves the grid', () => {
  const taken = STANDARD.panels.flatMap(({ x, y, w, h }) =>
    Array.from({ length: w * h }, (_, at) => `${x + (at % w)},${y + Math.floor(at / w)}`),
  );
  expect(new Set(taken).size).toBe(taken.length);
  for (const one of STANDARD.panels)
    expect(within(one.kind, one)).toMatchObject({ x: one.x, w: one.w, h: one.h });
});

it('a panel stays within the grid, and as large as its kind has to be', () => {
  expect(within('arm', { x: 99, y: -2, w: 1, h: 1 })).toEqual({ x: COLUMNS - 3, y: 0, w: 3, h: 5 });
  expect(within('charts', { x: 3, y: 2, w: 40, h: 7 })).toEqual({ x: 0, y: 2, w: COLUMNS, h: 7 });
});

it.each([
  ['[', 'no JSON'],
  ['{}', 'format'],
  [JSON.stringify({ format: FORMAT, panels: 3 }), 'a list of at most 40'],
  [
    JSON.stringify({ format: FORMAT, panels: [{ kind: 'toString' }] }),
    'Panel 1: its kind is "toString", allowed are',
  ],
  [
    JSON.stringify({ format: FORMAT, panels: [{ kind: 'arm', x: 0.5, y: 0, w: 3, h: 3 }] }),
    '"x" has to be a whole',
  ],
  [
    JSON.stringify({ format: FORMAT, panels: [{ kind: 'chart', x: 0, y: 0, w: 3, h: 3, signal: 'torque' }] }),
    'Panel 1: its signal is "torque", allowed are set_point',
  ],
  [
    JSON.stringify({ format: FORMAT, panels: [{ kind: 'chart', x: 0, y: 0, w: 3, h: 3, joints: [0] }] }),
    'from 1',
  ],
])('what is no layout is refused in one line: %s', (text, line) => {
  expect(() => layoutOf(text)).toThrow(line);
});

it('a broken link says so', async () => {
  await expect(unpacked('abc')).rejects.toThrow('not whole');
});

it('on a narrow screen panels change places, and none leaves the list', () => {
  const [first, second] = STANDARD.panels;
  expect(movedInOrder(STANDARD.panels, second!.id, -1).slice(0, 2)).toEqual([second, first]);
  expect(movedInOrder(STANDARD.panels, first!.id, -1)).toEqual(STANDARD.panels);
  expect(movedInOrder(STANDARD.panels, first!.id, 1)[1]).toEqual(first);
});
