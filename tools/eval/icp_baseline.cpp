#include "tools/eval/icp_baseline.hpp"

#include "runtime/src/model/eroded_elements.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

struct Cloud {
  std::vector<std::array<float, 3>> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][axis]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, std::uint32_t>;

struct NumberedElement {
  std::array<std::uint32_t, 4> nodes{};
  std::size_t number = 0;
};

/// Elements with all nodes in the observed region; if there are none, all elements.
std::vector<NumberedElement> observed_elements(const Model& model) {
  std::vector<std::uint8_t> observed(model.nodes(), 0);
  for (const std::uint32_t node : model.vertex_nodes(0)) observed[node] = 1;
  std::vector<NumberedElement> all, chosen;
  for (std::size_t e = 0; e < model.elements(); ++e) {
    NumberedElement element{.number = e};
    std::copy_n(&model.element_nodes()[4 * e], 4, element.nodes.begin());
    all.push_back(element);
    if (std::ranges::all_of(element.nodes, [&](std::uint32_t node) { return observed[node] != 0; }))
      chosen.push_back(element);
  }
  return chosen.empty() ? all : chosen;
}

/// The centers of side x side equal parts of each element (bilinear).
Cloud surface_points(std::span<const float> positions, std::span<const NumberedElement> elements, std::uint32_t side) {
  Cloud cloud;
  for (const auto& [element, number] : elements)
    for (std::uint32_t i = 0; i < side * side; ++i) {
      const float u = (static_cast<float>(i % side) + 0.5f) / static_cast<float>(side),
                  v = (static_cast<float>(i / side) + 0.5f) / static_cast<float>(side);
      const std::array<float, 4> shares{(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
      std::array<float, 3> point{};
      for (std::size_t k = 0; k < 4; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
          point[axis] += shares[k] * positions[3 * std::size_t{element[k]} + axis];
      cloud.points.push_back(point);
    }
  return cloud;
}

/// The rigid motion from `from` to `to` with the smallest sum of squares (Kabsch); columns are points.
Eigen::Isometry3d best_motion(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
  const Eigen::Vector3d a = from.rowwise().mean(), b = to.rowwise().mean();
  const Eigen::Matrix3d covariance = (to.colwise() - b) * (from.colwise() - a).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d sign(1, 1, 1);
  sign.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  motion.translation() = b - motion.linear() * a;
  return motion;
}

template <class T>
std::vector<T> every_nth(std::span<const T> items, std::size_t most) {
  const std::size_t count = std::min(items.size(), most);
  std::vector<T> chosen;
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(items[i * items.size() / count]);
  return chosen;
}

}  // namespace

struct IcpBaseline::Target {
  explicit Target(Cloud c) : cloud(std::move(c)), tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}

  /// Finds the nearest points; returns the mean squared distance to them.
  double nearest(const Eigen::Matrix3Xd& points, Eigen::Matrix3Xd& into) const {
    double sum = 0;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const std::array<float, 3> query{static_cast<float>(points(0, i)), static_cast<float>(points(1, i)),
                                       static_cast<float>(points(2, i))};
      std::uint32_t index = 0;
      float squared = 0;
      tree.knnSearch(query.data(), 1, &index, &squared);
      const auto& p = cloud.points[index];
      into.col(i) = Eigen::Vector3d(double{p[0]}, double{p[1]}, double{p[2]});
      sum += (points.col(i) - into.col(i)).squaredNorm();
    }
    return sum / static_cast<double>(points.cols());
  }

  Cloud cloud;
  Tree tree;
};

IcpBaseline::IcpBaseline(const Model& model, const IcpSettings& settings) : settings_(settings) {
  const auto observed = observed_elements(model);
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const std::vector<std::uint8_t> present = present_elements(model, s);
    auto elements = observed;
    if (!present.empty()) std::erase_if(elements, [&](const auto& element) { return present[element.number] == 0; });
    targets_.push_back(
        std::make_unique<const Target>(surface_points(model.node_positions(s), elements, settings.subdivision)));
  }
}
IcpBaseline::~IcpBaseline() = default;

double IcpBaseline::align(std::uint32_t sample, std::span<const std::array<double, 3>> points) const {
  Eigen::Matrix3Xd moving(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    moving.col(static_cast<Eigen::Index>(i)) = Eigen::Vector3d(points[i].data());
  Eigen::Matrix3Xd nearest(3, moving.cols());
  double error = targets_[sample]->nearest(moving, nearest);
  for (std::uint32_t i = 0; i < settings_.iterations; ++i) {
    moving = best_motion(moving, nearest) * moving;
    const double before = std::exchange(error, targets_[sample]->nearest(moving, nearest));
    if (before - error < settings_.converged * before) break;
  }
  return error;
}

IcpMatch IcpBaseline::match(std::span<const std::array<double, 3>> points) const {
  const auto few = every_nth(points, settings_.screening_points), many = every_nth(points, settings_.points);
  std::vector<IcpMatch> ranked;
  for (std::uint32_t s = 0; s < targets_.size(); ++s) ranked.push_back({s, align(s, few)});
  std::ranges::stable_sort(ranked, {}, &IcpMatch::mean_squared_error);
  ranked.resize(std::min<std::size_t>(ranked.size(), settings_.finalists));
  for (IcpMatch& finalist : ranked) finalist.mean_squared_error = align(finalist.sample, many);
  return *std::ranges::min_element(ranked, [](const IcpMatch& a, const IcpMatch& b) {
    return a.mean_squared_error != b.mean_squared_error ? a.mean_squared_error < b.mean_squared_error
                                                        : a.sample < b.sample;
  });
}

std::vector<std::array<double, 3>> spread_points(std::span<const Point> points, const RigidTransform& T,
                                                 const SampleBox& box, std::size_t most) {
  std::vector<std::array<double, 3>> inside;
  for (const Point& p : points) {
    std::array<double, 3> q{};
    bool keep = true;
    for (std::size_t i = 0; i < 3; ++i) {
      q[i] = double{T[4 * i]} * double{p.x} + double{T[4 * i + 1]} * double{p.y} + double{T[4 * i + 2]} * double{p.z} +
             double{T[4 * i + 3]};
      keep = keep && q[i] >= double{box.low[i]} && q[i] <= double{box.high[i]};
    }
    if (keep) inside.push_back(q);
  }
  return every_nth(std::span<const std::array<double, 3>>(inside), most);
}

}  // namespace lbea::tool
