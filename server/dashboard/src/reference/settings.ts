/** What may be tried from the reference of the API, and with which token. */

/** Reading only: this page has no Stop, so nothing that it sends may move the arm. */
export const METHODS_TO_TRY = ['get'];

export interface AskedRequest {
  url: string;
  headers: Record<string, string>;
}

/** The request with this tab's token, where there is one and it goes to this service. */
export function withToken<R extends AskedRequest>(request: R, token: string | null, origin: string): R {
  if (token !== null && new URL(request.url, origin).origin === origin)
    request.headers['Authorization'] = `Bearer ${token}`;
  return request;
}
