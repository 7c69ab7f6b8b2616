import { expect, it } from 'vitest';
import { placedFlags, type Flag } from './chart_flags';

const room = { left: 0, right: 400, gap: 4, width: (text: string) => text.length * 6 };
const flag = (x: number, label: string, rank = 2): Flag => ({ x, label, rank });
const texts = (flags: readonly Flag[]): string[] => placedFlags(flags, room).map((one) => one.text);

it('writes every name where there is room, behind its mark', () => {
  expect(placedFlags([flag(10, 'ramp'), flag(200, 'end')], room)).toEqual([
    { left: 14, text: 'ramp', index: 0 },
    { left: 204, text: 'end', index: 1 },
  ]);
});

it('gives a stop its word before its neighbours have taken the room', () => {
  const crowd = [flag(100, 'ramp ends'), flag(108, '▲ pause', 1), flag(116, '■ stop', 0), flag(120, 'end')];
  expect(texts(crowd)).toContain('■ stop');
  expect(texts([...crowd].reverse())).toContain('■ stop');
});

it('writes on the left what has no room on the right', () => {
  expect(placedFlags([flag(395, '■ stop', 0)], room)).toEqual([
    { left: 395 - 4 - 36, text: '■ stop', index: 0 },
  ]);
});

it('never writes one name over another, nor beyond the chart', () => {
  const many = Array.from({ length: 60 }, (_, index) =>
    flag((index * 37) % 400, `name ${index % 11}`, index % 3),
  );
  const placed = placedFlags(many, room);
  expect(placed.length).toBeGreaterThan(3);
  placed.forEach((one, index) => {
    const end = one.left + room.width(one.text);
    expect(one.left).toBeGreaterThanOrEqual(room.left);
    expect(end).toBeLessThanOrEqual(room.right);
    expect(placed[index + 1]?.left ?? Infinity).toBeGreaterThanOrEqual(end + room.gap);
  });
});

it('counts what is repeated, and keeps what is far apart', () => {
  expect(texts([flag(10, '▲ pause', 1), flag(40, '▲ pause', 1), flag(70, '▲ pause', 1)])).toEqual([
    '▲ pause ×3',
  ]);
  expect(texts([flag(10, '▲ pause', 1), flag(250, '▲ pause', 1)])).toEqual(['▲ pause', '▲ pause']);
});

it('leaves marks without a name alone', () => {
  expect(texts([flag(10, ''), flag(20, '')])).toEqual([]);
});
