// Grids of lists of a light's silhouette edges, one above the other in one texture of heads, face after face. Each grid has a quarter of
// the cells of the previous one along each side.
#ifndef GLS_EDGE_CELLS
#define GLS_EDGE_CELLS 512 // along a side of the finest grid
#endif
#ifndef GLS_EDGE_GRIDS
#define GLS_EDGE_GRIDS 4
#endif
const int EDGE_GRIDS = GLS_EDGE_GRIDS;
const int EDGE_ROWS = (4 * GLS_EDGE_CELLS - (GLS_EDGE_CELLS >> (2 * GLS_EDGE_GRIDS - 2))) / 3; // rows of all grids of a face
