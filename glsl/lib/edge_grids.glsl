// Grids that hold lists of a light's silhouette edges, one above the other in one texture of heads, face after face. Each has a quarter as
// many cells along a side as the one before.
#ifndef GLS_EDGE_CELLS
#define GLS_EDGE_CELLS 512 // along a side of the finest
#endif
#ifndef GLS_EDGE_GRIDS
#define GLS_EDGE_GRIDS 4
#endif
const int EDGE_GRIDS = GLS_EDGE_GRIDS;
const int EDGE_ROWS = (4 * GLS_EDGE_CELLS - (GLS_EDGE_CELLS >> (2 * GLS_EDGE_GRIDS - 2))) / 3; // of all grids of a face
