// The C interface to the pose error of a test.
#include "runtime/src/c_api/c_support.hpp"

using namespace lbea;

lbea_status lbea_test_pose_create(const lbea_model* model, lbea_test_pose** pose) {
  if (pose == nullptr) return bad_argument("lbea_test_pose_create: pose is NULL; give the address of a pointer");
  *pose = nullptr;
  if (model == nullptr) return bad_argument("lbea_test_pose_create: model is NULL; open one first");
  return guarded([&] {
    *pose = new lbea_test_pose(model->model);
    return LBEA_OK;
  });
}

void lbea_test_pose_destroy(lbea_test_pose* pose) { delete pose; }

void lbea_test_pose_reset(lbea_test_pose* pose) {
  if (pose != nullptr) pose->pose.reset();
}

int32_t lbea_test_pose_is_estimated(const lbea_test_pose* pose) {
  return pose != nullptr && pose->pose.is_estimated() ? 1 : 0;
}

lbea_status lbea_test_pose_get_correction(const lbea_test_pose* pose, float* T) {
  if (pose == nullptr || T == nullptr) return bad_argument("lbea_test_pose_get_correction: pose or T is NULL");
  std::ranges::copy(pose->pose.correction(), T);
  return LBEA_OK;
}
