import { describe, expect, it, vi } from 'vitest';

vi.stubGlobal('sessionStorage', { getItem: () => null });
vi.stubGlobal('location', { origin: 'https://lab', pathname: '/arm/' });
const { problemOfSignIn, roleText, signInAddress } = await import('./sign_in');
const { root } = await import('../api');

describe('signing in', () => {
  it('says why it has failed, also for a kind that it does not know', () => {
    expect(problemOfSignIn('')).toBe('');
    expect(problemOfSignIn('?robot=left')).toBe('');
    expect(problemOfSignIn('?robot=left&sign-in=no-role')).toContain('no role');
    expect(problemOfSignIn('?sign-in=<b>new</b>')).toBe(
      'You could not be signed in. The log of the service says why.',
    );
  });

  it('comes back to the robot that was shown', () => {
    expect(signInAddress('/api/v1/login/start', '')).toBe(`${root}/api/v1/login/start`);
    expect(signInAddress('/api/v1/login/start', 'left')).toBe(`${root}/api/v1/login/start?robot=left`);
  });

  it('says what somebody may do at this arm', () => {
    expect(roleText('viewer', false)).toContain('stops');
    expect(roleText('owner', false)).toContain('operator');
    expect(roleText('owner', true)).toContain('everybody');
    expect(roleText('admin', true)).toContain('admin');
  });
});
