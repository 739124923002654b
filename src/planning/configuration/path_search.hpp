#pragma once

#include <array>
#include <chrono>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include <flyball/core/random.hpp>
#include <flyball/planning/configuration/path_planner.hpp>

#include "planning/configuration/space_model.hpp"

// What the planners share: judged moves, trees, bounds of work.
namespace flyball::detail {

using Configuration = std::array<float, most_axes>;
using ConfigurationPath = std::vector<std::vector<double>>;

/// Counts the work of a search and says when it is over.
class WorkBound {
 public:
  WorkBound(long work, double seconds)
      : left_(work),
        end_(std::chrono::steady_clock::now() +
             std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                 std::chrono::duration<double>(std::min(seconds, 1e7)))),
        looked_(std::chrono::steady_clock::now()) {}
  /// A part of another: it ends with that, too.
  WorkBound(long work, double seconds, const WorkBound& whole) : WorkBound(work, seconds) {
    end_ = std::min(end_, whole.end_);
    over_ = whole.over_;
  }

  /// Does one piece of work. @return Whether there was one left.
  bool spend() noexcept {
    if (--left_ < 0 || over_) {
      return false;
    }
    ++done_;
    return !look();
  }
  /// Whether the time is over: the clock is read again after so many pieces of work as take a
  /// fraction of a millisecond, for a piece among a million nodes takes as long as thousands of
  /// others.
  bool look() noexcept {
    if (over_ || --until_ > 0) {
      return over_;
    }
    const auto now = std::chrono::steady_clock::now();
    const auto passed = now - looked_;
    constexpr int most = 256;
    interval_ = passed > std::chrono::milliseconds(1)     ? std::max(interval_ / 8, 1)
                : passed < std::chrono::microseconds(100) ? std::min(2 * interval_, most)
                                                          : interval_;
    until_ = interval_;
    looked_ = now;
    over_ = now > end_;
    return over_;
  }
  [[nodiscard]] long done() const noexcept { return done_; }
  [[nodiscard]] bool late() const noexcept { return over_; }
  [[nodiscard]] bool over() const noexcept { return over_ || left_ <= 0; }

 private:
  long left_;
  long done_ = 0;
  bool over_ = false;
  int interval_ = 16;
  int until_ = 16;
  std::chrono::steady_clock::time_point end_;
  std::chrono::steady_clock::time_point looked_;
};

/// Judges moves and boxes of a space in lanes.
class Judge {
 public:
  explicit Judge(const SpaceModel& model);

  void use_wide(bool wide) noexcept { wide_ = wide; }

  /// Whether the whole move is free; what is not proven is not.
  [[nodiscard]] bool free(const float* from, const float* by) noexcept;
  [[nodiscard]] bool free(const Configuration& from, const Configuration& by) noexcept {
    return free(from.data(), by.data());
  }

  /// Which boxes are free, or blocked as a whole, and where to cut them: see the kernel.
  void judge_boxes(const float* middles, const float* halves, BoxState* states,
                   int* axes) const noexcept;
  /// Smallest margins of eight configurations in shares of a box. @param half  Of it along each
  /// axis.
  void set_box(const double* half) noexcept;
  void reaches_of_set(const float* q, float* to) noexcept;

  [[nodiscard]] int nearest(const float* points, int stride, int count,
                            const float* to) const noexcept;

  /// to - from, the short way.
  void difference(const float* from, const float* to, float* by) const noexcept {
    for (int k = 0; k < dimension_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      by[k] = to[k] - from[k];
      if (turn_[i] > 0.0F) {
        by[k] -= turn_[i] * __builtin_rintf(by[k] / turn_[i]);
      }
    }
  }
  [[nodiscard]] float length(const float* by) const noexcept {
    float squared = 0.0F;
    for (int k = 0; k < dimension_; ++k) {
      const float d = by[k] * inverse_scale_[static_cast<std::size_t>(k)];
      squared += d * d;
    }
    return __builtin_sqrtf(squared);
  }
  [[nodiscard]] int dimension() const noexcept { return dimension_; }
  [[nodiscard]] const SpaceModel& model() const noexcept { return model_; }
  long moves = 0;

  /// Anywhere between the stops.
  void sample(Random& random, float* to) const noexcept;
  /// The size of the space in shares of the scale, for choosing steps.
  [[nodiscard]] float extent() const noexcept { return extent_; }

 private:
  const SpaceModel& model_;
  SpaceView<float> view_;
  int dimension_;
  bool wide_ = true;
  bool empty_;
  std::vector<float> rates_;
  InverseRates<float> set_{};
  std::vector<float> box_rates_{};
  BoxRates boxes_{};
  Configuration inverse_scale_{};
  Configuration turn_{};
  float extent_ = 0.0F;
};

/// A tree of configurations, coordinate by coordinate.
class Tree {
 public:
  explicit Tree(int dimension) : dimension_(dimension) { room(256); }

  void clear() noexcept;
  int add(const float* q, int parent);
  [[nodiscard]] int size() const noexcept { return count_; }
  void get(int i, float* q) const noexcept {
    for (int k = 0; k < dimension_; ++k) {
      q[k] = points_[static_cast<std::size_t>(k) * stride_ + static_cast<std::size_t>(i)];
    }
  }
  [[nodiscard]] int parent(int i) const noexcept { return parents_[static_cast<std::size_t>(i)]; }
  void set_parent(int i, int parent) noexcept { parents_[static_cast<std::size_t>(i)] = parent; }
  [[nodiscard]] int nearest(const Judge& judge, const float* to) const noexcept {
    return judge.nearest(points_.data(), static_cast<int>(stride_), count_, to);
  }
  /// From the root to a node.
  [[nodiscard]] std::vector<int> way_to(int node) const;

 private:
  void room(std::size_t count);

  int dimension_;
  int count_ = 0;
  std::size_t stride_ = 0;
  std::vector<float> points_{};
  std::vector<int> parents_{};
};

/// Boxes one beside the other, in which a path is looked for.
struct Channel {
  std::vector<Configuration> middles{};
  std::vector<Configuration> halves{};
};
/// Looks for a path along a channel with so many moves.
using GrowAlong =
    std::function<std::optional<ConfigurationPath>(const Channel& channel, long work)>;

/// Random trees from both ends. @return The waypoints; nothing when the work is done.
/// @param work  Moves of this call, within `bound`. @param channel  Where most samples are taken
/// from; null for anywhere.
std::optional<ConfigurationPath> rrt_connect(Judge& judge, Tree& a, Tree& b, const double* start,
                                             const double* goal, Random& random, long work,
                                             WorkBound& bound, const Channel* channel = nullptr);

/// The way of RRT*, if one was found when its nodes or its work are there.
std::optional<ConfigurationPath> rrt_star(Judge& judge, Tree& tree, const double* start,
                                          const double* goal, Random& random, int nodes,
                                          WorkBound& bound);

/// Makes angles that wrap go on from waypoint to waypoint.
void lift(const SpaceModel& model, ConfigurationPath& path);

/// Takes detours out: moves over waypoints, then over parts of moves, as long as there is time.
void shorten(Judge& judge, ConfigurationPath& path, Random& random, int rounds, WorkBound& bound);

/// A place and how far it is.
struct NearPlace {
  int place;
  float length;
};
/// The nearest places of a graph, in the order of their distance. Cost: O(places).
[[nodiscard]] std::vector<NearPlace> nearest_places(const Judge& judge,
                                                    const std::vector<Configuration>& places,
                                                    const Configuration& q, std::size_t most);

}  // namespace flyball::detail
