/**
 * Where models come from, as a tree: the machine's own model, the jobs that were given a model, the models that jobs
 * made. Traces that a job was made from belong to it. Pure: what is open and what has the focus is handed in.
 */

import type { Job, ModelEntry, ModelLineage } from '../api/types';

export type NodeKind = 'machine' | 'model' | 'job' | 'gone';

export interface LineageNode {
  /** `model ID`, `job ID`, `machine`, `gone ID`: unique in the tree. */
  key: string;
  kind: NodeKind;
  id: string;
  label: string;
  model: ModelEntry | null;
  job: Job | null;
  traces: readonly string[];
  held: readonly string[];
  children: readonly LineageNode[];
}

/** A line of the tree as it is shown. */
export interface LineageRow {
  node: LineageNode;
  /** 1 for a root. */
  level: number;
  open: boolean;
  /** Place among those with the same parent, from 1, and how many there are. */
  place: number;
  of: number;
  /** For every level above it whether a line goes on below. */
  rails: readonly boolean[];
}

/** The roots of the tree: the machine first, then models whose parent is not here. */
export function lineageTree(found: ModelLineage, machineName: string): LineageNode[] {
  const known = new Set(found.models.map((one) => one.id));
  const madeBy = new Map(found.jobs.filter((job) => job.model !== null).map((job) => [job.model, job]));
  const placed = new Set<string>();

  const parentKey = (model: ModelEntry): string => {
    if (model.parent === null) return `model ${model.id}`;
    if (model.parent === found.machine) return 'machine';
    return known.has(model.parent) ? `model ${model.parent}` : `gone ${model.parent}`;
  };

  /** A job hangs below the first model that it was given: a comparison has several. */
  const givenTo = (job: Job): string => {
    const first = 'models' in job.request ? job.request.models.at(-1) : job.request.model;
    return first === undefined || first === 'machine' ? 'machine' : `model ${first}`;
  };

  const modelNode = (model: ModelEntry): LineageNode => {
    placed.add(model.id);
    return {
      ...EMPTY,
      key: `model ${model.id}`,
      kind: 'model',
      id: model.id,
      label: model.name,
      model,
      traces: model.traces,
      children: childrenOf(`model ${model.id}`),
    };
  };

  const jobNode = (job: Job): LineageNode => {
    const made = found.models.find((one) => one.id === job.model && !placed.has(one.id));
    return {
      ...EMPTY,
      key: `job ${job.id}`,
      kind: 'job',
      id: job.id,
      label: jobTitle(job),
      job,
      traces: job.request.traces,
      held: 'held_out' in job.request ? job.request.held_out : [],
      children: made === undefined ? [] : [modelNode(made)],
    };
  };

  const childrenOf = (key: string): LineageNode[] => {
    const jobs = found.jobs.filter((job) => givenTo(job) === key).map(jobNode);
    const without = found.models
      .filter((one) => !placed.has(one.id) && parentKey(one) === key && !madeBy.has(one.id))
      .map(modelNode);
    return [...jobs, ...without];
  };

  const machine: LineageNode = {
    ...EMPTY,
    key: 'machine',
    kind: 'machine',
    id: 'machine',
    label: machineName,
    children: childrenOf('machine'),
  };
  const roots = [machine];
  for (const model of found.models) {
    if (placed.has(model.id)) continue;
    const key = parentKey(model);
    const gone = model.parent !== null && !known.has(model.parent) && key !== 'machine';
    const own = modelNode(model);
    roots.push(
      gone
        ? {
            ...EMPTY,
            key,
            kind: 'gone',
            id: model.parent ?? '',
            label: 'a model that is gone',
            children: [own],
          }
        : own,
    );
  }
  return roots;
}

const EMPTY = { model: null, job: null, traces: [], held: [], children: [] } as const;

export const JOB_NAMES: Record<Job['request']['kind'], string> = {
  fit: 'Fit',
  validate: 'Validation',
  compare: 'Simulation',
  diagnose: 'Diagnosis',
};

/** What a job is: `Fit`. */
export function jobName(job: Job): string {
  const name = 'name' in job.request ? (job.request.name ?? '') : '';
  return JOB_NAMES[job.request.kind] + (name === '' ? '' : `: ${name}`);
}

/** The same with what tells it from others of its kind: `Fit: friction, joint2.*`. */
export function jobTitle(job: Job): string {
  const name = jobName(job);
  const sought = 'parameters' in job.request ? (job.request.parameters ?? []).join(' ') : '';
  return sought === '' ? name : `${name}${name.includes(':') ? ',' : ':'} ${sought}`;
}

/** The lines that are shown: children of what is closed are not. */
export function shownRows(
  nodes: readonly LineageNode[],
  closed: ReadonlySet<string>,
  level = 1,
  rails: readonly boolean[] = [],
): LineageRow[] {
  return nodes.flatMap((node, index) => {
    const open = node.children.length > 0 && !closed.has(node.key);
    const last = index === nodes.length - 1;
    const row: LineageRow = {
      node,
      level,
      open,
      place: index + 1,
      of: nodes.length,
      rails: [...rails, !last],
    };
    return [row, ...(open ? shownRows(node.children, closed, level + 1, row.rails) : [])];
  });
}

export type TreeMove = { focus: string } | { open: string } | { close: string } | null;

/** What a key does in a tree, as assistive technology expects it (ARIA's pattern for trees). */
export function treeKey(rows: readonly LineageRow[], focused: string, key: string): TreeMove {
  const index = rows.findIndex((row) => row.node.key === focused);
  const row = rows[index];
  if (row === undefined) return rows[0] === undefined ? null : { focus: rows[0].node.key };
  const at = (place: number): TreeMove => {
    const other = rows[place];
    return other === undefined ? null : { focus: other.node.key };
  };
  switch (key) {
    case 'ArrowDown':
      return at(index + 1);
    case 'ArrowUp':
      return at(index - 1);
    case 'Home':
      return at(0);
    case 'End':
      return at(rows.length - 1);
    case 'ArrowRight':
      if (row.node.children.length === 0) return null;
      return row.open ? at(index + 1) : { open: row.node.key };
    case 'ArrowLeft':
      if (row.open) return { close: row.node.key };
      return at(rows.findLastIndex((other, place) => place < index && other.level < row.level));
    default:
      return null;
  }
}
