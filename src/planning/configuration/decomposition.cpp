#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <utility>

#include "planning/configuration/decomposition.hpp"

namespace flyball::detail {

namespace {

/// A box of the binary tree: halves of halves along one axis after the other.
struct Box {
  std::array<std::uint32_t, 8> low;  ///< In units of 2^-20 of each axis.
  std::array<std::uint8_t, 8> cuts;  ///< How often each axis has been halved.
  BoxState state;
  std::uint8_t axis;     ///< Along which it is split, or is to be.
  std::uint8_t reached;  ///< From the start (1), from the goal (2).
  int child;             ///< The first of two.
};

constexpr std::uint32_t whole = 1U << 20;
constexpr int most_dimension = 8;

class Boxes {
 public:
  Boxes(Judge& judge, const double* start, const double* goal, long most, WorkBound& bound)
      : judge_(judge),
        n_(judge.dimension()),
        most_(most),
        bound_(bound),
        start_(start),
        goal_(goal) {
    for (int k = 0; k < n_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const SpaceAxis& axis = judge.model().axes[i];
      wraps_[i] = axis.wraps;
      low_[i] = axis.wraps ? -std::numbers::pi : axis.low;
      size_[i] = axis.wraps ? 2.0 * std::numbers::pi : axis.high - axis.low;
    }
    Box root{};
    classify(std::span(&root, 1));
    boxes_.push_back(root);
  }

  BoxAnswer run() {
    BoxAnswer answer;
    // Coarse first: each round floods from both ends through what is not blocked, splitting what is
    // not decided down to the round's size.
    for (int depth = n_; depth <= 20 * n_ && !bound_.over(); ++depth) {
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

  /// The leaf that holds a point, split down to a depth while it is mixed.
  int leaf_at(const double* q, int deepest) {
    std::array<std::uint32_t, most_dimension> at{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(n_); ++i) {
      double share = (q[i] - low_[i]) / size_[i];
      share -= wraps_[i] ? std::floor(share) : 0.0;
      at[i] = std::min(static_cast<std::uint32_t>(std::max(share, 0.0) * whole), whole - 1);
    }
    int index = 0;
    while (true) {
      Box& box = boxes_[static_cast<std::size_t>(index)];
      if (box.state == BoxState::mixed && depth(box, n_) < deepest) {
        split(index, deepest);
      }
      const Box& now = boxes_[static_cast<std::size_t>(index)];
      if (now.state != BoxState::split) {
        return index;
      }
      const std::size_t a = now.axis;
      const Box& first = boxes_[static_cast<std::size_t>(now.child)];
      const std::uint32_t end = first.low[a] + (whole >> first.cuts[a]);
      index = now.child + (at[a] >= end ? 1 : 0);
    }
  }

  /// All leaves that touch a face of a box, split down to a depth while they are mixed.
  template <class Found>
  void across(int index, int deepest, const Found& found) {
    const Box box = boxes_[static_cast<std::size_t>(index)];
    for (std::size_t axis = 0; axis < static_cast<std::size_t>(n_); ++axis) {
      const std::uint32_t size = whole >> box.cuts[axis];
      for (const bool up : {false, true}) {
        std::uint32_t line = up ? box.low[axis] + size : box.low[axis];
        if (up ? line == whole : line == 0) {
          if (!wraps_[axis]) {
            continue;
          }
          line = up ? 0 : whole;
        }
        stack_.assign(1, 0);
        while (!stack_.empty()) {
          const int i = stack_.back();
          stack_.pop_back();
          {
            const Box& other = boxes_[static_cast<std::size_t>(i)];
            bool touches = true;
            for (std::size_t k = 0; k < static_cast<std::size_t>(n_) && touches; ++k) {
              const std::uint32_t from = other.low[k];
              const std::uint32_t to = from + (whole >> other.cuts[k]);
              if (k == axis) {
                touches = up ? from <= line && line < to : from < line && line <= to;
              } else {
                const std::uint32_t mine = box.low[k];
                touches = from < mine + (whole >> box.cuts[k]) && mine < to;
              }
            }
            if (!touches || other.state == BoxState::blocked) {
              continue;
            }
            if (other.state == BoxState::free) {
              found(i);
              continue;
            }
            if (other.state == BoxState::mixed && depth(other, n_) >= deepest) {
              found(i);
              continue;
            }
          }
          if (boxes_[static_cast<std::size_t>(i)].state == BoxState::mixed) {
            split(i, deepest);
          }
          const int child = boxes_[static_cast<std::size_t>(i)].child;
          stack_.push_back(child);
          stack_.push_back(child + 1);
        }
      }
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
      return FloodEnd::met;
    }
    std::array<std::vector<int>, 2> queues{std::vector<int>{source}, std::vector<int>{target}};
    std::array<std::size_t, 2> heads{};
    boxes_[static_cast<std::size_t>(source)].reached = 1;
    boxes_[static_cast<std::size_t>(target)].reached = 2;
    bool met = false;
    for (std::size_t side = 0; !met; side = 1 - side) {
      if (heads[side] == queues[side].size()) {
        return FloodEnd::closed;
      }
      if (static_cast<long>(boxes_.size()) > most_ || !bound_.spend()) {
        return FloodEnd::full;
      }
      const auto mark = static_cast<std::uint8_t>(side + 1);
      across(queues[side][heads[side]++], deepest, [&](int i) {
        Box& box = boxes_[static_cast<std::size_t>(i)];
        if (box.reached == 0) {
          box.reached = mark;
          queues[side].push_back(i);
        }
        met = met || box.reached != mark;
      });
    }
    return FloodEnd::met;
  }

  /// Through free boxes alone, from middle to middle of what they share; nothing if there is none.
  std::optional<Path> path() {
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
    Path path{std::vector<double>(start_, start_ + n_)};
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
  long most_;
  WorkBound& bound_;
  const double* start_;
  const double* goal_;
  std::array<double, most_dimension> low_{};
  std::array<double, most_dimension> size_{};
  std::array<bool, most_dimension> wraps_{};
  std::vector<Box> boxes_{};
  std::vector<int> queue_{};
  std::vector<int> came_{};
  std::vector<int> stack_{};
};

}  // namespace

BoxAnswer decompose(Judge& judge, const double* start, const double* goal, long boxes,
                    WorkBound& bound) {
  if (judge.dimension() > most_dimension) {
    return {};
  }
  Boxes all(judge, start, goal, boxes, bound);
  return all.run();
}

}  // namespace flyball::detail
