#include <algorithm>
#include <cmath>
#include <utility>

#include "planning/configuration/path_search.hpp"

namespace flyball::detail {

Judge::Judge(const SpaceModel& model)
    : model_(model),
      view_(model.quick.view()),
      dimension_(model.dimension()),
      empty_(model.quick.rate_count() == 0),
      rates_(2 * model.quick.rate_count()) {
  for (std::size_t k = 0; k < model.axes.size(); ++k) {
    const SpaceAxis& axis = model.axes[k];
    inverse_scale_[k] = static_cast<float>(1.0 / axis.scale);
    turn_[k] = axis.wraps ? static_cast<float>(2.0 * std::numbers::pi) : 0.0F;
    const double way = axis.wraps ? std::numbers::pi : axis.high - axis.low;
    extent_ += static_cast<float>(way * way / (axis.scale * axis.scale));
  }
  extent_ = std::sqrt(extent_);
  // What boxes are judged by: rates of pairs and limits, roundings, and how much each coordinate
  // changes everything.
  const RateStep& rates = model.quick.rates;
  for (const std::vector<double>* table : {&rates.pairs, &rates.holds}) {
    for (const double rate : *table) {
      box_rates_.push_back(static_cast<float>(rate * (1.0 + 1e-6)));
    }
  }
  for (std::size_t i = 0; i < model.quick.holds.size(); ++i) {
    box_rates_.push_back(static_cast<float>(
        2.5 * (model.exact.holds[i].limit - static_cast<double>(model.quick.holds[i].limit))));
  }
  std::vector<double> inverse(model.exact.rate_count());
  for (std::size_t k = 0; k < model.axes.size(); ++k) {
    std::array<double, most_axes> by{};
    by[k] = 1.0;
    inverse_rates(model.exact, by.data(), inverse.data());
    double sum = 1e-6;
    for (const double one : inverse) {
      sum += one < 1e29 ? 1.0 / one : 0.0;
    }
    box_rates_.push_back(static_cast<float>(sum));
  }
  const float* const from = box_rates_.data();
  const float* const holds = from + rates.pairs.size();
  const float* const slacks = holds + rates.holds.size();
  boxes_ = {from, holds, slacks, slacks + model.quick.holds.size(),
            static_cast<float>(2.5 * model.quick.slack)};
}

bool Judge::free(const float* from, const float* by) noexcept {
  ++moves;
  if (empty_) {
    return true;
  }
  std::array<double, most_axes> change;
  for (int k = 0; k < dimension_; ++k) {
    change[static_cast<std::size_t>(k)] = static_cast<double>(by[k]);
  }
  const InverseRates<float> rates = inverse_rates(model_.quick, change.data(), rates_.data());
  constexpr int most_batches = 24;
#ifdef FLYBALL_WIDE_VECTORS
  if (wide_ && has_wide_vectors()) {
    return wide::check_edge(view_, from, by, rates, most_batches) == EdgeState::free;
  }
#endif
  return baseline::check_edge(view_, from, by, rates, most_batches) == EdgeState::free;
}

void Judge::set_box(const double* half) noexcept {
  set_ = inverse_rates(model_.quick, half, rates_.data() + model_.quick.rate_count());
}

void Judge::reaches_of_set(const float* q, float* to) noexcept {
  if (empty_) {
    std::fill_n(to, lanes, 1e30F);
    return;
  }
#ifdef FLYBALL_WIDE_VECTORS
  if (wide_ && has_wide_vectors()) {
    wide::reaches(view_, q, set_, to);
    return;
  }
#endif
  baseline::reaches(view_, q, set_, to);
}

void Judge::judge_boxes(const float* middles, const float* halves, BoxState* states,
                        int* axes) const noexcept {
#ifdef FLYBALL_WIDE_VECTORS
  if (wide_ && has_wide_vectors()) {
    wide::judge_boxes(view_, middles, halves, boxes_, states, axes);
    return;
  }
#endif
  baseline::judge_boxes(view_, middles, halves, boxes_, states, axes);
}

int Judge::nearest(const float* points, int stride, int count, const float* to) const noexcept {
#ifdef FLYBALL_WIDE_VECTORS
  if (wide_ && has_wide_vectors()) {
    return wide::nearest(points, stride, count, dimension_, inverse_scale_.data(), turn_.data(),
                         to);
  }
#endif
  return baseline::nearest(points, stride, count, dimension_, inverse_scale_.data(), turn_.data(),
                           to);
}

void Judge::sample(Random& random, float* to) const noexcept {
  for (int k = 0; k < dimension_; ++k) {
    const SpaceAxis& axis = model_.axes[static_cast<std::size_t>(k)];
    const double low = axis.wraps ? -std::numbers::pi : axis.low;
    const double high = axis.wraps ? std::numbers::pi : axis.high;
    // Rounding to a float must not step over a stop.
    to[k] = static_cast<float>(low + (high - low) * (1e-6 + random.uniform() * (1.0 - 2e-6)));
  }
}

void Tree::room(std::size_t count) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> points(static_cast<std::size_t>(dimension_) * count, none);
  for (int k = 0; k < dimension_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    std::copy_n(points_.begin() + static_cast<std::ptrdiff_t>(i * stride_), count_,
                points.begin() + static_cast<std::ptrdiff_t>(i * count));
  }
  points_ = std::move(points);
  stride_ = count;
}

void Tree::clear() noexcept {
  // Places beyond the last must not be near to anything.
  std::fill_n(points_.begin(), count_, std::numeric_limits<float>::quiet_NaN());
  count_ = 0;
  parents_.clear();
}

int Tree::add(const float* q, int parent) {
  if (static_cast<std::size_t>(count_) == stride_) {
    room(2 * stride_);
  }
  for (int k = 0; k < dimension_; ++k) {
    points_[static_cast<std::size_t>(k) * stride_ + static_cast<std::size_t>(count_)] = q[k];
  }
  parents_.push_back(parent);
  return count_++;
}

std::vector<int> Tree::way_to(int node) const {
  std::vector<int> way;
  for (int i = node; i >= 0; i = parent(i)) {
    way.push_back(i);
  }
  std::reverse(way.begin(), way.end());
  return way;
}

namespace {

std::vector<double> doubles(const float* q, int dimension) {
  return {q, q + dimension};
}

/// The waypoints of two ways that met, with their ends as they were given.
ConfigurationPath join(const Tree& a, int at_a, const Tree& b, int at_b, int dimension,
                       const double* start, const double* goal, bool swapped) {
  ConfigurationPath path;
  Configuration q{};
  for (const int i : a.way_to(at_a)) {
    a.get(i, q.data());
    path.push_back(doubles(q.data(), dimension));
  }
  std::vector<int> way = b.way_to(at_b);
  std::reverse(way.begin(), way.end());
  for (const int i : way) {
    b.get(i, q.data());
    path.push_back(doubles(q.data(), dimension));
  }
  if (swapped) {
    std::reverse(path.begin(), path.end());
  }
  path.front().assign(start, start + dimension);
  path.back().assign(goal, goal + dimension);
  path.erase(std::unique(path.begin(), path.end()), path.end());
  return path;
}

}  // namespace

std::optional<ConfigurationPath> rrt_connect(Judge& judge, Tree& a, Tree& b, const double* start,
                                             const double* goal, Random& random, long work,
                                             WorkBound& bound, const Channel* channel) {
  const int n = judge.dimension();
  constexpr double share_of_channel = 0.85;
  Configuration q{};
  Configuration by{};
  Configuration near{};
  Configuration fresh{};
  if (a.size() == 0) {
    for (int k = 0; k < n; ++k) {
      q[static_cast<std::size_t>(k)] = static_cast<float>(start[k]);
      near[static_cast<std::size_t>(k)] = static_cast<float>(goal[k]);
    }
    a.add(q.data(), -1);
    b.add(near.data(), -1);
  }
  const float range = 0.25F * judge.extent();
  Tree* from = &a;
  Tree* to = &b;
  for (long i = 0; i < work && bound.spend(); ++i) {
    if (channel != nullptr && random.uniform() < share_of_channel) {
      const auto box = std::min(
          static_cast<std::size_t>(random.uniform() * static_cast<double>(channel->middles.size())),
          channel->middles.size() - 1);
      for (int k = 0; k < n; ++k) {
        const auto j = static_cast<std::size_t>(k);
        q[j] = channel->middles[box][j] +
               channel->halves[box][j] * static_cast<float>(random.uniform(-1.0, 1.0));
      }
    } else {
      judge.sample(random, q.data());
    }
    int at = from->nearest(judge, q.data());
    from->get(at, near.data());
    judge.difference(near.data(), q.data(), by.data());
    const float way = judge.length(by.data());
    const float share = way > range ? range / way : 1.0F;
    for (int k = 0; k < n; ++k) {
      const auto j = static_cast<std::size_t>(k);
      by[j] *= share;
      fresh[j] = near[j] + by[j];
    }
    if (judge.free(near, by)) {
      const int grown = from->add(fresh.data(), at);
      at = to->nearest(judge, fresh.data());
      while (true) {
        to->get(at, near.data());
        judge.difference(near.data(), fresh.data(), by.data());
        const float rest = judge.length(by.data());
        const bool last = rest <= range;
        Configuration step = near;
        for (int k = 0; k < n; ++k) {
          const auto j = static_cast<std::size_t>(k);
          by[j] *= last ? 1.0F : range / rest;
          step[j] += by[j];
        }
        ++i;
        if (!judge.free(near, by)) {
          break;
        }
        if (last) {
          return join(*from, grown, *to, at, n, start, goal, from == &b);
        }
        at = to->add(step.data(), at);
      }
    }
    if (from->size() > to->size()) {
      std::swap(from, to);
    }
  }
  return std::nullopt;
}

std::optional<ConfigurationPath> rrt_star(Judge& judge, Tree& tree, const double* start,
                                          const double* goal, Random& random, int nodes,
                                          WorkBound& bound) {
  const int n = judge.dimension();
  Configuration q{};
  Configuration by{};
  Configuration near{};
  Configuration fresh{};
  Configuration end{};
  std::vector<float> costs{0.0F};
  for (int k = 0; k < n; ++k) {
    q[static_cast<std::size_t>(k)] = static_cast<float>(start[k]);
    end[static_cast<std::size_t>(k)] = static_cast<float>(goal[k]);
  }
  tree.add(q.data(), -1);
  const float range = 0.25F * judge.extent();
  int arrived = -1;
  const auto between = [&](int i, const float* to) {
    tree.get(i, near.data());
    judge.difference(near.data(), to, by.data());
    return judge.length(by.data());
  };
  while (tree.size() < nodes && bound.spend()) {
    const bool aim = arrived < 0 && random.uniform() < 0.1;
    if (aim) {
      q = end;
    } else {
      judge.sample(random, q.data());
    }
    int parent = tree.nearest(judge, q.data());
    const float way = between(parent, q.data());
    const float share = way > range ? range / way : 1.0F;
    for (int k = 0; k < n; ++k) {
      const auto j = static_cast<std::size_t>(k);
      by[j] *= share;
      fresh[j] = near[j] + by[j];
    }
    if (!(way > 0.0F) || !judge.free(near, by)) {
      continue;
    }
    // γ (ln n / n)^(1/d), no more than a step.
    const float count = static_cast<float>(tree.size()) + 1.0F;
    const float radius = std::min(
        range, judge.extent() * std::pow(std::log(count) / count, 1.0F / static_cast<float>(n)));
    float cost = costs[static_cast<std::size_t>(parent)] + share * way;
    std::vector<int> around;
    for (int i = 0; i < tree.size(); ++i) {
      const float length = between(i, fresh.data());
      if (length < radius) {
        around.push_back(i);
        if (costs[static_cast<std::size_t>(i)] + length < cost && judge.free(near, by)) {
          cost = costs[static_cast<std::size_t>(i)] + length;
          parent = i;
        }
      }
    }
    const int grown = tree.add(fresh.data(), parent);
    costs.push_back(cost);
    for (const int i : around) {
      const float length = between(i, fresh.data());
      if (cost + length < costs[static_cast<std::size_t>(i)] - 1e-6F && judge.free(near, by)) {
        const float gain = costs[static_cast<std::size_t>(i)] - cost - length;
        tree.set_parent(i, grown);
        // What hangs on it has its way shortened, too.
        std::vector<int> open{i};
        while (!open.empty()) {
          const int at = open.back();
          open.pop_back();
          costs[static_cast<std::size_t>(at)] -= gain;
          for (int c = 1; c < tree.size(); ++c) {
            if (tree.parent(c) == at) {
              open.push_back(c);
            }
          }
        }
      }
    }
    const float rest = between(grown, end.data());
    if (aim && rest == 0.0F) {
      arrived = grown;
    } else if (arrived < 0 && rest < range && judge.free(near, by)) {
      arrived = tree.add(end.data(), grown);
      costs.push_back(cost + rest);
    }
  }
  if (arrived < 0) {
    return std::nullopt;
  }
  ConfigurationPath path;
  for (const int i : tree.way_to(arrived)) {
    tree.get(i, near.data());
    path.push_back(doubles(near.data(), n));
  }
  path.front().assign(start, start + n);
  path.back().assign(goal, goal + n);
  return path;
}

void lift(const SpaceModel& model, ConfigurationPath& path) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    for (std::size_t k = 0; k < model.axes.size(); ++k) {
      if (model.axes[k].wraps) {
        path[i][k] =
            path[i - 1][k] + std::remainder(path[i][k] - path[i - 1][k], 2.0 * std::numbers::pi);
      }
    }
  }
}

std::vector<NearPlace> nearest_places(const Judge& judge, const std::vector<Configuration>& places,
                                      const Configuration& q, std::size_t most) {
  std::vector<NearPlace> all(places.size());
  Configuration by{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    judge.difference(q.data(), places[i].data(), by.data());
    all[i] = {static_cast<int>(i), judge.length(by.data())};
  }
  const std::size_t kept = std::min(most, all.size());
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(kept), all.end(),
                    [](const NearPlace& a, const NearPlace& b) {
                      return a.length < b.length || (a.length == b.length && a.place < b.place);
                    });
  all.resize(kept);
  return all;
}

void shorten(Judge& judge, ConfigurationPath& path, Random& random, int rounds, WorkBound& bound) {
  const int n = judge.dimension();
  Configuration from{};
  Configuration by{};
  const auto free = [&](const std::vector<double>& a, const std::vector<double>& b) {
    for (int k = 0; k < n; ++k) {
      const auto j = static_cast<std::size_t>(k);
      from[j] = static_cast<float>(a[j]);
      by[j] = static_cast<float>(b[j] - a[j]);
    }
    return judge.free(from, by);
  };
  const auto length = [&](const std::vector<double>& a, const std::vector<double>& b) {
    for (int k = 0; k < n; ++k) {
      const auto j = static_cast<std::size_t>(k);
      by[j] = static_cast<float>(b[j] - a[j]);
    }
    return static_cast<double>(judge.length(by.data()));
  };
  for (std::size_t i = 0; i + 2 < path.size(); ++i) {
    for (std::size_t j = path.size() - 1; j > i + 1; --j) {
      if (bound.look()) {
        return;
      }
      if (free(path[i], path[j])) {
        path.erase(path.begin() + static_cast<std::ptrdiff_t>(i + 1),
                   path.begin() + static_cast<std::ptrdiff_t>(j));
        break;
      }
    }
  }
  const auto between = [&](std::size_t i, double s) {
    std::vector<double> q = path[i];
    for (std::size_t k = 0; k < q.size(); ++k) {
      q[k] += s * (path[i + 1][k] - q[k]);
    }
    return q;
  };
  for (int round = 0; round < rounds && path.size() > 2 && !bound.look(); ++round) {
    const auto moves = static_cast<double>(path.size() - 1);
    const double u = random.uniform(0.0, moves);
    const double v = random.uniform(0.0, moves);
    const double low = std::min(u, v);
    const double high = std::max(u, v);
    const auto i = static_cast<std::size_t>(low);
    const auto j = std::min(static_cast<std::size_t>(high), path.size() - 2);
    if (i >= j) {
      continue;
    }
    std::vector<double> a = between(i, low - static_cast<double>(i));
    std::vector<double> b = between(j, high - static_cast<double>(j));
    double old = length(a, path[i + 1]) + length(path[j], b);
    for (std::size_t k = i + 1; k < j; ++k) {
      old += length(path[k], path[k + 1]);
    }
    if (length(a, b) < old * (1.0 - 1e-4) && free(a, b)) {
      path.erase(path.begin() + static_cast<std::ptrdiff_t>(i + 1),
                 path.begin() + static_cast<std::ptrdiff_t>(j + 1));
      path.insert(path.begin() + static_cast<std::ptrdiff_t>(i + 1), {std::move(a), std::move(b)});
    }
  }
  for (std::size_t i = 0; i + 2 < path.size() && !bound.look();) {
    if (free(path[i], path[i + 2])) {
      path.erase(path.begin() + static_cast<std::ptrdiff_t>(i + 1));
    } else {
      ++i;
    }
  }
}

}  // namespace flyball::detail
