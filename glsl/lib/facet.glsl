// A triangle in one light's frame: vertices relative to the light (directional: to the centre of its grid), and the unit normal. Written by
// pass/lists.comp, twin glshadow.derive.lists.facets: three texels, the normal in their w.
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
