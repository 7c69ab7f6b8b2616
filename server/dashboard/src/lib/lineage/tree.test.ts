import { describe, expect, it } from 'vitest';
import type { Job, ModelEntry, ModelLineage } from '../api/types';
import { jobTitle, lineageTree, shownRows, treeKey, type LineageNode } from './tree';

const model = (id: string, parent: string | null, job: string | null): ModelEntry => ({
  id,
  robot: 'r',
  name: `model ${id}`,
  created: '2026-01-01T00:00:00Z',
  created_by: 'x',
  parent,
  job,
  traces: ['t1'],
  notes: '',
});
const job = (id: string, request: object, made: string | null): Job =>
  ({ id, model: made, state: 'done', request: { traces: ['t1'], ...request } }) as unknown as Job;

const lineage: ModelLineage = {
  machine: 'base',
  models: [
    model('a', 'base', 'f'),
    model('b', 'a', 'd'),
    model('up', null, null),
    model('orphan', 'lost', null),
  ],
  jobs: [
    job('f', { kind: 'fit', model: 'machine', held_out: ['t2'] }, 'a'),
    job('v', { kind: 'validate', model: 'a' }, null),
    job('d', { kind: 'diagnose', model: 'a', held_out: [] }, 'b'),
    job('c', { kind: 'compare', models: ['machine', 'b'] }, null),
  ],
};
const drawn = (nodes: readonly LineageNode[]): unknown =>
  nodes.map((one) => (one.children.length === 0 ? one.key : [one.key, drawn(one.children)]));

it('a fit is called by its name and what it looks for', () => {
  const asked = { kind: 'fit', model: 'machine', held_out: [], name: 'cold', parameters: ['joint2.*'] };
  expect(jobTitle(job('f', asked, null))).toBe('Fit: cold, joint2.*');
  expect(jobTitle(job('f', { kind: 'fit', model: 'machine' }, null))).toBe('Fit');
});

describe('the tree of models', () => {
  const roots = lineageTree(lineage, 'arm');

  it('leads from the machine over jobs to models', () => {
    expect(drawn(roots)).toEqual([
      ['machine', [['job f', [['model a', ['job v', ['job d', [['model b', ['job c']]]]]]]]]],
      'model up',
      ['gone lost', ['model orphan']],
    ]);
  });

  it('shows every model and every job once', () => {
    const keys = shownRows(roots, new Set()).map((row) => row.node.key);
    expect(new Set(keys).size).toBe(keys.length);
    expect(keys).toHaveLength(4 + 4 + 2);
  });

  it('keeps the traces with the job that was made from them', () => {
    const fit = roots[0]?.children[0];
    expect([fit?.traces, fit?.held]).toEqual([['t1'], ['t2']]);
  });

  it('hides what lies below a closed line', () => {
    const rows = shownRows(roots, new Set(['job f']));
    expect(rows.map((row) => row.node.key)).toEqual([
      'machine',
      'job f',
      'model up',
      'gone lost',
      'model orphan',
    ]);
    expect(rows.map((row) => row.level)).toEqual([1, 2, 1, 1, 2]);
  });

  it('keeps a model whose maker came back under another job only once', () => {
    const twice = { ...lineage, jobs: [...lineage.jobs, job('f2', { kind: 'fit', model: 'machine' }, 'a')] };
    const keys = shownRows(lineageTree(twice, 'arm'), new Set()).map((row) => row.node.key);
    expect(keys.filter((key) => key === 'model a')).toHaveLength(1);
  });
});

describe('keys in the tree', () => {
  const rows = shownRows(lineageTree(lineage, 'arm'), new Set(['model a']));
  const press = (from: string, key: string): unknown => treeKey(rows, from, key);

  it('move, open and close as in every tree', () => {
    expect(press('machine', 'ArrowDown')).toEqual({ focus: 'job f' });
    expect(press('machine', 'ArrowUp')).toBeNull();
    expect(press('model a', 'ArrowRight')).toEqual({ open: 'model a' });
    expect(press('job f', 'ArrowRight')).toEqual({ focus: 'model a' });
    expect(press('job f', 'ArrowLeft')).toEqual({ close: 'job f' });
    expect(press('model a', 'ArrowLeft')).toEqual({ focus: 'job f' });
    expect(press('model up', 'ArrowRight')).toBeNull();
    expect(press('job f', 'End')).toEqual({ focus: 'model orphan' });
    expect(press('model up', 'Home')).toEqual({ focus: 'machine' });
    expect(press('model up', 'x')).toBeNull();
  });

  it('begin at the first line when the focused one is gone', () => {
    expect(press('job gone', 'ArrowDown')).toEqual({ focus: 'machine' });
  });
});
