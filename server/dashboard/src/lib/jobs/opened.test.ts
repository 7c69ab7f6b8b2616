import { beforeEach, describe, expect, it, vi } from 'vitest';
import { notAnswered, Problem } from '../api/problem';
import type { Job } from '../api/types';
import { OpenedJob, type JobList, type JobRequests } from './opened.svelte';

const job = (state: Job['state'], kind = 'fit'): Job =>
  ({ id: 'a', state, submitted: '2026-01-01', request: { kind } }) as unknown as Job;
const FOUND = { kind: 'fit', data: { models: [] } };

let list: { all: readonly Job[] | null; problem: Problem | null; remove: JobList['remove'] };
let requests: { [name in keyof JobRequests]: ReturnType<typeof vi.fn<JobRequests[name]>> };

const opened = (): OpenedJob => new OpenedJob('a', list, ['fit'], requests);
/** Until everything that was asked has been answered. */
const answered = (): Promise<unknown> => new Promise((resolve) => setTimeout(resolve));

beforeEach(() => {
  list = { all: [job('done')], problem: null, remove: () => Promise.resolve() };
  requests = {
    job: vi.fn(() => Promise.resolve(job('done'))),
    result: vi.fn(() => Promise.resolve(FOUND)),
    save: vi.fn(() => Promise.resolve()),
  };
});

describe('a job that is looked at', () => {
  it('loads its result once, however often it is looked at', async () => {
    const one = opened();
    expect(one.isAwaited).toBe(true);
    one.follow();
    one.follow();
    await answered();
    one.follow();
    expect(requests.result).toHaveBeenCalledTimes(1);
    expect(one.result).toBe(FOUND);
    expect(one.isAwaited).toBe(false);
  });

  it('loads its result after a request has failed, when it is told to', async () => {
    requests.result.mockRejectedValueOnce(notAnswered());
    const one = opened();
    one.follow();
    await answered();
    expect(one.problem?.status).toBe(0);
    one.follow();
    expect(requests.result).toHaveBeenCalledTimes(1);
    one.retry();
    expect(one.problem).toBeNull();
    await answered();
    expect(one.result).toBe(FOUND);
  });

  it('waits for its end, and asks for no result that is shown elsewhere', async () => {
    list.all = [job('running')];
    const one = opened();
    one.follow();
    list.all = [job('done', 'diagnose')];
    one.follow();
    await answered();
    expect(requests.result).not.toHaveBeenCalled();
    list.all = [job('done')];
    one.follow();
    await answered();
    expect(one.result).toBe(FOUND);
  });

  it('is asked for alone where it is older than the list, or the list could not be loaded', async () => {
    list.all = null;
    const one = opened();
    one.follow();
    await answered();
    expect(requests.job).not.toHaveBeenCalled();
    list.problem = notAnswered();
    one.follow();
    await answered();
    expect(one.job?.state).toBe('done');
    one.follow();
    await answered();
    expect([requests.job.mock.calls.length, one.result]).toEqual([1, FOUND]);
  });

  it('asks for its result as soon as the job itself is known', async () => {
    list.all = [];
    const one = opened();
    one.follow();
    while (one.job === null) await Promise.resolve();
    one.follow();
    await answered();
    expect(one.result).toBe(FOUND);
  });

  it('says what could not be done without taking away what is shown', async () => {
    const one = opened();
    one.follow();
    await answered();
    requests.save.mockRejectedValueOnce(notAnswered());
    await one.save('report.html', 'html');
    expect(requests.save).toHaveBeenCalledWith('/jobs/a/report.html', 'fit-a.html');
    expect([one.refused?.status, one.problem, one.result]).toEqual([0, null, FOUND]);
    await one.save('result', 'json');
    expect(one.refused).toBeNull();
  });

  it('is not asked for again once it is taken away, and stays when that was refused', async () => {
    list.remove = () => Promise.reject(new Problem(409, 'running', 'it still runs'));
    const one = opened();
    expect(await one.remove()).toBe(false);
    expect(one.refused?.detail).toBe('it still runs');
    list.remove = () => Promise.resolve();
    expect(await one.remove()).toBe(true);
    list.all = [];
    one.follow();
    await answered();
    expect(requests.job).not.toHaveBeenCalled();
  });
});
