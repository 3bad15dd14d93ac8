// A triangle as one light sees it: vertices in the light's frame, relative to the light (a sun: to the middle of its grid), and the
// unit normal. Written by pass/lists.comp, twin glshadow.derive.lists.facets: three texels, the normal in their w.
uniform samplerBuffer u_facets;

struct Facet {
    vec3 a;
    vec3 b;
    vec3 c;
    vec3 normal;
};

Facet facet(int triangle) {
    vec4 a = texelFetch(u_facets, 3 * triangle), b = texelFetch(u_facets, 3 * triangle + 1), c = texelFetch(u_facets, 3 * triangle + 2);
    return Facet(a.xyz, b.xyz, c.xyz, vec3(a.w, b.w, c.w));
}
