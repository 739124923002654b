#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>

#include "planning/configuration/decomposition.hpp"

namespace flyball::detail {

/// A box of the binary tree: halves of halves along one axis after the other.
struct DecompositionBox {
  std::array<std::uint32_t, 8> low;  ///< In units of 2^-20 of each axis.
  std::array<std::uint8_t, 8> cuts;  ///< How often each axis has been halved.
  BoxState state;
  std::uint8_t axis;     ///< Along which it is split, or is to be.
  std::uint8_t reached;  ///< From the start (1), from the goal (2).
  int child;             ///< The first of two.
  int parent;            ///< -1 for the whole.
};

namespace {

using Box = DecompositionBox;

constexpr std::uint32_t whole = 1U << 20;
constexpr int most_dimension = 8;

}  // namespace

class BoxTree::Boxes {
 public:
  explicit Boxes(Judge& judge) : judge_(judge), n_(judge.dimension()) {
    for (int k = 0; k < n_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const SpaceAxis& axis = judge.model().axes[i];
      wraps_[i] = axis.wraps;
      low_[i] = axis.wraps ? -std::numbers::pi : axis.low;
      size_[i] = axis.wraps ? 2.0 * std::numbers::pi : axis.high - axis.low;
    }
    Box root{};
    root.parent = -1;
    classify(std::span(&root, 1));
    boxes_.push_back(root);
  }

  BoxAnswer run(const double* start, const double* goal, long most, WorkBound& bound,
                const GrowAlong& along) {
    constexpr long most_kept = 10'000'000;
    start_ = start;
    goal_ = goal;
    most_ = std::min(most_kept, static_cast<long>(boxes_.size()) + most);
    bound_ = &bound;
    BoxAnswer answer;
    answer.boxes = static_cast<long>(boxes_.size());
    if (parted()) {
      answer.proven = true;
      return answer;
    }
    std::size_t before = boxes_.size();
    // Coarse first: each round floods from both ends through what is not blocked, splitting what is
    // not decided down to the round's size.
    for (int depth = n_; depth <= 20 * n_ && !bound.over(); ++depth) {
      const FloodEnd end = flood(depth);
      answer.boxes = static_cast<long>(boxes_.size());
      if (end == FloodEnd::closed) {
        answer.proven = true;
        return answer;
      }
      if (end == FloodEnd::full) {
        return answer;
      }
      answer.finest = std::ldexp(1.0, -(depth / n_));
      answer.path = path();
      if (answer.path) {
        return answer;
      }
      if (along) {  // as much work as there was in boxes
        constexpr std::size_t least = 200;
        const std::size_t work = std::max(least, boxes_.size() - before);
        answer.path = along(channel_, static_cast<long>(work));
        answer.grown = answer.path.has_value();
        if (answer.path) {
          return answer;
        }
      }
      before = boxes_.size();
    }
    return answer;
  }

 private:
  enum class FloodEnd { closed, met, full };

  [[nodiscard]] double half(const Box& box, std::size_t i) const {
    return std::ldexp(0.5 * size_[i], -static_cast<int>(box.cuts[i]));
  }
  [[nodiscard]] double middle(const Box& box, std::size_t i) const {
    return low_[i] + size_[i] * (static_cast<double>(box.low[i]) / whole) + half(box, i);
  }
  [[nodiscard]] static int depth(const Box& box, int n) {
    int sum = 0;
    for (int k = 0; k < n; ++k) {
      sum += box.cuts[static_cast<std::size_t>(k)];
    }
    return sum;
  }

  /// Free, blocked or mixed, and where to cut.
  void classify(std::span<Box> some) {
    std::array<float, most_axes * lanes> middles{};
    std::array<float, most_axes * lanes> halves{};
    std::array<BoxState, lanes> states{};
    std::array<int, lanes> axes{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(n_); ++i) {
      for (std::size_t l = 0; l < lanes; ++l) {
        const Box& box = some[std::min(l, some.size() - 1)];
        middles[i * lanes + l] = static_cast<float>(middle(box, i));
        halves[i * lanes + l] = static_cast<float>(half(box, i));
      }
    }
    judge_.judge_boxes(middles.data(), halves.data(), states.data(), axes.data());
    for (std::size_t l = 0; l < some.size(); ++l) {
      some[l].state = states[l];
      const auto wanted = static_cast<std::size_t>(std::max(axes[l], 0));
      some[l].axis =
          static_cast<std::uint8_t>(some[l].cuts[wanted] < 20 ? wanted : least_cut(some[l]));
    }
  }

  /// What is left to cut where the axis that matters is as fine as it goes.
  [[nodiscard]] std::size_t least_cut(const Box& box) const {
    std::size_t least = 0;
    for (std::size_t i = 1; i < static_cast<std::size_t>(n_); ++i) {
      least = box.cuts[i] < box.cuts[least] ? i : least;
    }
    return least;
  }

  /// Three cuts one after the other, so that all lanes are used: boxes that are not decided after
  /// one are cut again as long as a depth allows.
  void split(int index, int deepest) {
    std::array<int, lanes> open{index};
    std::size_t count = 1;
    for (int round = 0; round < 3 && count > 0; ++round) {
      std::array<Box, lanes> children{};
      std::size_t made = 0;
      for (std::size_t i = 0; i < count; ++i) {
        Box& parent = boxes_[static_cast<std::size_t>(open[i])];
        const std::size_t axis = parent.axis;
        Box child = parent;
        child.cuts[axis] = static_cast<std::uint8_t>(child.cuts[axis] + 1);
        child.reached = 0;
        child.child = 0;
        child.parent = open[i];
        parent.state = BoxState::split;
        parent.child = static_cast<int>(boxes_.size() + made);
        children[made++] = child;
        child.low[axis] += whole >> child.cuts[axis];
        children[made++] = child;
      }
      classify(std::span(children.data(), made));
      const int first = static_cast<int>(boxes_.size());
      boxes_.insert(boxes_.end(), children.begin(),
                    children.begin() + static_cast<std::ptrdiff_t>(made));
      for (std::size_t i = 0; i < count; ++i) {
        settle(open[i]);
      }
      count = 0;
      for (std::size_t i = 0; i < made; ++i) {
        if (children[i].state == BoxState::mixed && depth(children[i], n_) < deepest) {
          open[count++] = first + static_cast<int>(i);
        }
      }
      if (2 * count > lanes) {
        break;
      }
    }
  }

  /// A box of two that are blocked is blocked, one of two that are free is free, and so on upwards.
  void settle(int index) {
    while (index >= 0) {
      Box& box = boxes_[static_cast<std::size_t>(index)];
      const BoxState first = boxes_[static_cast<std::size_t>(box.child)].state;
      const BoxState second = boxes_[static_cast<std::size_t>(box.child) + 1].state;
      if (first != second || (first != BoxState::blocked && first != BoxState::free)) {
        return;
      }
      box.state = first;
      index = box.parent;
    }
  }

  /// The leaf that holds a point, split down to a depth while it is mixed.
  int leaf_at(const double* q, int deepest) {
    const auto at = place_of(q);
    int index = 0;
    while (true) {
      Box& box = boxes_[static_cast<std::size_t>(index)];
      if (box.state == BoxState::mixed && depth(box, n_) < deepest) {
        split(index, deepest);
      }
      const Box& now = boxes_[static_cast<std::size_t>(index)];
      if (now.state != BoxState::split || (deepest > 0 && depth(now, n_) >= deepest)) {
        return index;
      }
      index = child_at(index, at);
    }
  }

  /// In units of 2^-20 of each axis.
  [[nodiscard]] std::array<std::uint32_t, most_dimension> place_of(const double* q) const {
    std::array<std::uint32_t, most_dimension> at{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(n_); ++i) {
      double share = (q[i] - low_[i]) / size_[i];
      share -= wraps_[i] ? std::floor(share) : 0.0;
      at[i] = std::min(static_cast<std::uint32_t>(std::max(share, 0.0) * whole), whole - 1);
    }
    return at;
  }

  /// The child that holds a place.
  [[nodiscard]] int child_at(int index, const std::array<std::uint32_t, most_dimension>& at) const {
    const Box& box = boxes_[static_cast<std::size_t>(index)];
    const Box& first = boxes_[static_cast<std::size_t>(box.child)];
    const std::uint32_t end = first.low[box.axis] + (whole >> first.cuts[box.axis]);
    return box.child + (at[box.axis] >= end ? 1 : 0);
  }

  /// All leaves that touch a face of a box, split down to a depth while they are mixed. In one
  /// descent: what it comes through overlaps the box, but along one axis at most, where it touches.
  template <class Found>
  void across(int index, int deepest, const Found& found) {
    const Box box = boxes_[static_cast<std::size_t>(index)];
    std::array<std::uint32_t, most_dimension> ends{};
    for (std::size_t k = 0; k < static_cast<std::size_t>(n_); ++k) {
      ends[k] = box.low[k] + (whole >> box.cuts[k]);
    }
    const auto touches = [&](const Box& other) {
      int sides = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(n_); ++k) {
        const std::uint32_t from = other.low[k];
        const std::uint32_t to = from + (whole >> other.cuts[k]);
        if (from < ends[k] && box.low[k] < to) {
          continue;
        }
        const bool beside =
            from == ends[k] || to == box.low[k] ||
            (wraps_[k] && ((from == 0 && ends[k] == whole) || (to == whole && box.low[k] == 0)));
        if (!beside || ++sides > 1) {
          return false;
        }
      }
      return true;
    };
    stack_.assign(1, 0);
    while (!stack_.empty() && !bound_->look()) {
      const int i = stack_.back();
      stack_.pop_back();
      const Box& other = boxes_[static_cast<std::size_t>(i)];
      if (i == index || other.state == BoxState::blocked || !touches(other)) {
        continue;
      }
      if (other.state == BoxState::free) {
        found(i);
        continue;
      }
      // What is finer from an earlier query is not looked into.
      if ((other.state == BoxState::mixed || (deepest > 0 && other.state == BoxState::split)) &&
          depth(other, n_) >= deepest) {
        found(i);
        continue;
      }
      if (other.state == BoxState::mixed) {
        split(i, deepest);
        stack_.push_back(i);
        continue;
      }
      stack_.push_back(other.child);
      stack_.push_back(other.child + 1);
    }
  }

  /// From both ends by turns, until they meet or one has nowhere left to go.
  FloodEnd flood(int deepest) {
    for (Box& box : boxes_) {
      box.reached = 0;
    }
    const int source = leaf_at(start_, deepest);
    const int target = leaf_at(goal_, deepest);
    if (source == target) {
      came_.assign(boxes_.size(), -1);
      set_channel(source, -1);
      return FloodEnd::met;
    }
    std::array<std::vector<int>, 2> queues{std::vector<int>{source}, std::vector<int>{target}};
    std::array<std::size_t, 2> heads{};
    boxes_[static_cast<std::size_t>(source)].reached = 1;
    boxes_[static_cast<std::size_t>(target)].reached = 2;
    came_.assign(boxes_.size(), -1);
    int met = -1;
    int met_from = -1;
    for (std::size_t side = 0; met < 0; side = 1 - side) {
      if (bound_->look()) {  // what the last box touches may not all be found
        return FloodEnd::full;
      }
      if (heads[side] == queues[side].size()) {
        close(queues[side]);
        return FloodEnd::closed;
      }
      if (static_cast<long>(boxes_.size()) > most_ || !bound_->spend()) {
        return FloodEnd::full;
      }
      const auto mark = static_cast<std::uint8_t>(side + 1);
      const int at = queues[side][heads[side]++];
      across(at, deepest, [&](int i) {
        Box& box = boxes_[static_cast<std::size_t>(i)];
        if (box.reached == 0) {
          box.reached = mark;
          came_.resize(boxes_.size(), -1);
          came_[static_cast<std::size_t>(i)] = at;
          queues[side].push_back(i);
        } else if (box.reached != mark && met < 0) {
          met = i;
          met_from = at;
        }
      });
    }
    set_channel(met, met_from);
    return FloodEnd::met;
  }

  /// Keeps what nothing leaves: these boxes have none but blocked ones beside them.
  void close(const std::vector<int>& all) {
    constexpr std::size_t most_kept = 64;
    if (closed_.size() < most_kept) {
      std::vector<bool> inside(boxes_.size(), false);
      for (const int i : all) {
        inside[static_cast<std::size_t>(i)] = true;
      }
      closed_.push_back(std::move(inside));
    }
  }

  /// Whether one end is within what an earlier query found closed, and the other is not.
  [[nodiscard]] bool parted() {
    if (closed_.empty()) {
      return false;
    }
    std::array<std::vector<bool>, 2> in;
    for (std::size_t e = 0; e < 2; ++e) {
      in[e].assign(closed_.size(), false);
      const auto at = place_of(e == 0 ? start_ : goal_);
      // Down to the finest, also below what was merged since.
      for (int i = 0;;) {
        for (std::size_t c = 0; c < closed_.size(); ++c) {
          const auto k = static_cast<std::size_t>(i);
          in[e][c] = in[e][c] || (k < closed_[c].size() && closed_[c][k]);
        }
        if (boxes_[static_cast<std::size_t>(i)].child == 0) {
          break;
        }
        i = child_at(i, at);
      }
    }
    return in[0] != in[1];
  }

  /// The boxes through which two met.
  void set_channel(int one, int other) {
    channel_.middles.clear();
    channel_.halves.clear();
    for (const int end : {one, other}) {
      for (int i = end; i >= 0; i = came_[static_cast<std::size_t>(i)]) {
        const Box& box = boxes_[static_cast<std::size_t>(i)];
        Configuration q{};
        Configuration by{};
        for (std::size_t k = 0; k < static_cast<std::size_t>(n_); ++k) {
          q[k] = static_cast<float>(middle(box, k));
          by[k] = static_cast<float>(half(box, k));
        }
        channel_.middles.push_back(q);
        channel_.halves.push_back(by);
      }
    }
  }

  /// Through free boxes alone, from middle to middle of what they share; nothing if there is none.
  std::optional<ConfigurationPath> path() {
    // The ends' own boxes may be mixed.
    const int source = leaf_at(start_, 0);
    const int target = leaf_at(goal_, 0);
    for (Box& box : boxes_) {
      box.reached = 0;
    }
    came_.assign(boxes_.size(), -1);
    queue_.assign(1, source);
    boxes_[static_cast<std::size_t>(source)].reached = 1;
    bool found = source == target;
    for (std::size_t head = 0; head < queue_.size() && !found; ++head) {
      const int at = queue_[head];
      across(at, 0, [&](int i) {
        Box& box = boxes_[static_cast<std::size_t>(i)];
        if (box.reached == 0 && (box.state == BoxState::free || i == target)) {
          box.reached = 1;
          came_[static_cast<std::size_t>(i)] = at;
          queue_.push_back(i);
          found = found || i == target;
        }
      });
    }
    if (!found) {
      return std::nullopt;
    }
    std::vector<int> way;
    for (int i = target; i >= 0; i = came_[static_cast<std::size_t>(i)]) {
      way.push_back(i);
    }
    std::reverse(way.begin(), way.end());
    ConfigurationPath path{std::vector<double>(start_, start_ + n_)};
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      const Box& a = boxes_[static_cast<std::size_t>(way[i])];
      const Box& b = boxes_[static_cast<std::size_t>(way[i + 1])];
      // By the middle of a box to the middle of what it shares with the next: boxes are convex.
      std::vector<double> q;
      for (std::size_t k = 0; k < static_cast<std::size_t>(n_); ++k) {
        q.push_back(middle(a, k));
      }
      if (i > 0) {
        path.push_back(std::move(q));
      }
      path.push_back(shared(a, b));
    }
    path.emplace_back(goal_, goal_ + n_);
    lift(judge_.model(), path);
    // The ends' boxes may be mixed: every move is judged again.
    Configuration from{};
    Configuration by{};
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      for (std::size_t k = 0; k < static_cast<std::size_t>(n_); ++k) {
        from[k] = static_cast<float>(path[i][k]);
        by[k] = static_cast<float>(path[i + 1][k] - path[i][k]);
      }
      if (!judge_.free(from, by)) {
        return std::nullopt;
      }
    }
    return path;
  }

  [[nodiscard]] std::vector<double> shared(const Box& a, const Box& b) const {
    std::vector<double> q;
    for (std::size_t k = 0; k < static_cast<std::size_t>(n_); ++k) {
      const double a0 = middle(a, k) - half(a, k);
      const double a1 = middle(a, k) + half(a, k);
      double b0 = middle(b, k) - half(b, k);
      double b1 = middle(b, k) + half(b, k);
      if (wraps_[k]) {
        const double turn =
            2.0 * std::numbers::pi *
            std::round((0.5 * (a0 + a1) - 0.5 * (b0 + b1)) / (2.0 * std::numbers::pi));
        b0 += turn;
        b1 += turn;
      }
      q.push_back(0.5 * (std::max(a0, b0) + std::min(a1, b1)));
    }
    return q;
  }

 private:
  Judge& judge_;
  int n_;
  long most_ = 0;
  WorkBound* bound_ = nullptr;
  const double* start_ = nullptr;
  const double* goal_ = nullptr;
  std::array<double, most_dimension> low_{};
  std::array<double, most_dimension> size_{};
  std::array<bool, most_dimension> wraps_{};
  std::vector<Box> boxes_{};
  std::vector<int> queue_{};
  std::vector<int> came_{};
  std::vector<int> stack_{};
  Channel channel_{};
  std::vector<std::vector<bool>> closed_{};  ///< By the boxes: what nothing leaves.
};

BoxTree::BoxTree(Judge& judge) : boxes_(nullptr) {
  if (judge.dimension() <= most_dimension) {
    boxes_ = std::make_unique<Boxes>(judge);
  }
}
BoxTree::~BoxTree() = default;

BoxAnswer BoxTree::connect(const double* start, const double* goal, long boxes, WorkBound& bound,
                           const GrowAlong& along) {
  return boxes_ ? boxes_->run(start, goal, boxes, bound, along) : BoxAnswer{};
}

}  // namespace flyball::detail
