import { describe, expect, it } from 'vitest';
import { reordered, type Queued } from './order';

const queued = (id: string, priority: number, second: number): Queued => ({
  id,
  priority,
  submitted: `2026-01-01T00:00:${String(second).padStart(2, '0')}Z`,
});

/** As the service orders them. */
function inOrder(queue: readonly Queued[]): string[] {
  return [...queue]
    .sort((one, other) => other.priority - one.priority || one.submitted.localeCompare(other.submitted))
    .map((one) => one.id);
}

function after(queue: readonly Queued[], from: number, to: number): string[] {
  const changes = new Map(reordered(queue, from, to)!.map((change) => [change.id, change.priority]));
  return inOrder(queue.map((one) => ({ ...one, priority: changes.get(one.id) ?? one.priority })));
}

describe('a new order of the queue', () => {
  it('comes out of the service as it was wanted, for every move', () => {
    const priorities = [
      [0, 0, 0, 0, 0],
      [9, 9, 4, 0, -3],
      [5, 0, 0, 0, 0],
      [1, 1, 0, 0, -100],
    ];
    for (const chosen of priorities) {
      const queue = chosen.map((priority, index) => queued(`e${index}`, priority, index));
      for (let from = 0; from < queue.length; from++) {
        for (let to = 0; to < queue.length; to++) {
          const wanted = queue.map((one) => one.id);
          wanted.splice(to, 0, ...wanted.splice(from, 1));
          expect(after(queue, from, to), `${chosen} ${from} → ${to}`).toEqual(wanted);
        }
      }
    }
  });

  it('changes nothing where nothing moves', () => {
    const queue = [queued('a', 3, 0), queued('b', 0, 1)];
    expect(reordered(queue, 1, 1)).toEqual([]);
    expect(reordered(queue, 0, -1)).toEqual([]);
  });

  it('changes one priority where one is enough', () => {
    expect(reordered([queued('a', 0, 0), queued('b', 0, 1)], 1, 0)).toEqual([{ id: 'b', priority: 1 }]);
  });

  it('says when there is no priority left', () => {
    expect(reordered([queued('a', 100, 0), queued('b', 0, 1)], 1, 0)).toBeNull();
  });
});
