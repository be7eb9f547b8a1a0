int qpgen2_(double *G, double *av, int n, double *xv, double *lagr, double *obj, double *C, double *bv, int q, int meq,
            int *iact, int *nact, int *iter, double *work, int factorized);

int peer_quadprog(double *R, double *a, int n, double *x, double *multipliers, double *C, double *b, int q, int *active,
                  int *changes, double *work) {
    double objective;
    int count, iterations[2] = {0, 0};
    int flag = qpgen2_(R, a, n, x, multipliers, &objective, C, b, q, 0, active, &count, iterations, work, 1);
    *changes = iterations[0] + iterations[1];
    return flag;
}
