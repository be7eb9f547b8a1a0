#include <stdlib.h>
#include <string.h>
#include "api.h"

/* The least-distance problem itself, M precomputed: what DAQP comes down to when only limits change. */
void *peer_daqp_new(int n, int m, const double *M) {
    DAQPWorkspace *work = calloc(1, sizeof(DAQPWorkspace));
    allocate_daqp_settings(work);
    allocate_daqp_workspace(work, n, 0);
    allocate_daqp_ldp(work, n, m, 0, 0, 0);
    work->m = m;
    work->ms = 0;
    memcpy(work->M, M, sizeof(double) * n * m);
    for (int i = 0; i < m; i++) work->scaling[i] = 1;
    memset(work->sense, 0, sizeof(int) * m);
    return work;
}

double *peer_daqp_upper(void *workspace) { return ((DAQPWorkspace *)workspace)->dupper; }
double *peer_daqp_lower(void *workspace) { return ((DAQPWorkspace *)workspace)->dlower; }

/* Starts from its own last working set, whose factor it keeps. */
int peer_daqp_solve(void *workspace, double *w, int *changes) {
    DAQPWorkspace *work = workspace;
    work->reuse_ind = 0;
    int flag = daqp_ldp(work);
    memcpy(w, work->u, sizeof(double) * work->n);
    *changes = work->iterations;
    if (flag < 0) daqp_deactivate_constraints(work);
    return flag;
}
