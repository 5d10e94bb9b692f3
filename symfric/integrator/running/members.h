typedef struct {
  long long members, attempts;
  double dt, h_min;
  double *S, *R, *u, *begin;
  long long *count, *ready, *why, *made;
} symfric_members;
