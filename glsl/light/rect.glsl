// Slot <light>: a rectangular area light that emits from one side, uniformly (Lambert). GLS_WIDE: a surface's irradiance does not come from
// a single direction. It is that of the polygon above the receiver's horizon: Lambert 1760. Twin:
// glshadow.lights.rect
#define GLS_WIDE 1
uniform mat3 u_rect; // half width, half height, emitting direction
uniform vec2 u_reach; // 1 / range (0: infinite)

vec4 light_arriving(vec3 position_lv) {
    float distance_lv = length(position_lv), window = distance_lv * u_reach.x;
    window = max(1.0 - window * window * window * window, 0.0);
    return vec4(-position_lv / max(distance_lv, 1e-30), window * window);
}

bool light_shines_on(vec3 position_lv) {
    return dot(position_lv, u_rect[2]) > 0.0;
}

vec2 light_received(vec3 position_lv, vec3 normal) { // irradiance relative to a full hemisphere of it; share of it above the horizon
    vec2 ring[4] = vec2[4](vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0));
    vec3 kept[5];
    vec2 place[5];
    int count = 0;
    for (int i = 0; i < 4; i++) {
        vec2 a = ring[i], b = ring[(i + 1) % 4];
        vec3 p = u_rect[0] * a.x + u_rect[1] * a.y - position_lv, q = u_rect[0] * b.x + u_rect[1] * b.y - position_lv;
        float height = dot(p, normal), next = dot(q, normal);
        if (height > 0.0) {
            kept[count] = p;
            place[count] = a;
            count++;
        }
        if ((height > 0.0) != (next > 0.0) && count < 5) {
            float share = height / (height - next);
            kept[count] = p + share * (q - p);
            place[count] = a + share * (b - a);
            count++;
        }
    }
    float sum = 0.0, area = 0.0;
    for (int i = 0; i < count; i++) {
        int j = i + 1 < count ? i + 1 : 0;
        vec3 p = normalize(kept[i]), q = normalize(kept[j]), turn = cross(p, q);
        float size = length(turn);
        sum += atan(size, dot(p, q)) / max(size, 1e-20) * dot(turn, normal);
        area += place[i].x * place[j].y - place[i].y * place[j].x;
    }
    return light_shines_on(position_lv) ? vec2(abs(sum) / 6.283185307, abs(area) / 8.0) : vec2(0.0);
}
