// The C interface to what the frames of a test have shown.
#include "runtime/src/c_api/c_support.hpp"

using namespace lbea;

lbea_status lbea_test_history_create(const lbea_model* model, lbea_test_history** history) {
  if (history == nullptr)
    return bad_argument("lbea_test_history_create: history is NULL; give the address of a pointer");
  *history = nullptr;
  if (model == nullptr) return bad_argument("lbea_test_history_create: model is NULL; open one first");
  return guarded([&] {
    *history = new lbea_test_history(model->model);
    return LBEA_OK;
  });
}

void lbea_test_history_destroy(lbea_test_history* history) { delete history; }

void lbea_test_history_reset(lbea_test_history* history) {
  if (history != nullptr) history->history.reset();
}

void lbea_test_history_fix_pose(lbea_test_history* history) {
  if (history != nullptr) history->history.fix_pose();
}

void lbea_test_history_set_impact(lbea_test_history* history, int64_t stamp_ns) {
  if (history != nullptr) history->history.set_impact(stamp_ns);
}

int32_t lbea_test_history_estimates_pose(const lbea_test_history* history) {
  return history != nullptr && history->history.estimates_pose() ? 1 : 0;
}

lbea_status lbea_test_history_get_pose_correction(const lbea_test_history* history, float* T) {
  if (history == nullptr || T == nullptr)
    return bad_argument("lbea_test_history_get_pose_correction: history or T is NULL");
  std::ranges::copy(history->history.pose_correction(), T);
  return LBEA_OK;
}
