#include "common/trials/shifted.h"

namespace gapfarm {

TrialLog shifted(TrialLog log, double dx_m, double dy_m) {
  if (dx_m == 0 && dy_m == 0) return log;
  const auto move = [&](double* x, double* y) { *x += dx_m, *y += dy_m; };
  for (Trial& t : log.trials) {
    move(&t.X_WS.x, &t.X_WS.y);
    move(&t.X_WE.x, &t.X_WE.y);
    for (PathSample& s : t.path) move(&s.pose.x, &s.pose.y);
    for (TipSample& s : t.tip) move(&s.x, &s.y);
  }
  return log;
}

}  // namespace gapfarm
