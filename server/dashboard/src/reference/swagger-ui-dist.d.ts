/** The part of swagger-ui-dist's options that is used here: the package has no types of its own. */
declare module 'swagger-ui-dist/swagger-ui-es-bundle.js' {
  interface Request {
    url: string;
    headers: Record<string, string>;
  }
  interface Options {
    dom_id: string;
    url: string;
    docExpansion: 'list' | 'full' | 'none';
    defaultModelsExpandDepth: number;
    filter: boolean;
    supportedSubmitMethods: readonly string[];
    requestInterceptor: (request: Request) => Request;
    validatorUrl: string | null;
  }
  export default function SwaggerUI(options: Options): unknown;
}
