#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "planning/configuration/known_moves.hpp"

namespace flyball::detail {

namespace {

constexpr std::size_t most_places = 1000;
constexpr std::size_t most_exits = 6;  ///< Moves from an end to the graph that are judged.

Configuration rounded(const double* q, int dimension) {
  Configuration place{};
  for (int k = 0; k < dimension; ++k) {
    place[static_cast<std::size_t>(k)] = static_cast<float>(q[k]);
  }
  return place;
}

}  // namespace

int KnownMoves::part_of(int place) noexcept {
  int name = place;
  while (parts_[static_cast<std::size_t>(name)] != name) {
    name = parts_[static_cast<std::size_t>(name)];
  }
  parts_[static_cast<std::size_t>(place)] = name;
  return name;
}

void KnownMoves::join(int a, int b, float length) {
  links_[static_cast<std::size_t>(a)].push_back({b, length});
  links_[static_cast<std::size_t>(b)].push_back({a, length});
  parts_[static_cast<std::size_t>(part_of(b))] = part_of(a);
}

void KnownMoves::learn(Judge& judge, const ConfigurationPath& path) {
  Configuration by{};
  int before = -1;
  for (const std::vector<double>& waypoint : path) {
    if (places_.size() >= most_places) {
      return;
    }
    const Configuration q = rounded(waypoint.data(), judge.dimension());
    const std::vector<NearPlace> near = nearest_places(judge, places_, q, most_exits);
    const int here = size();
    places_.push_back(q);
    links_.emplace_back();
    parts_.push_back(here);
    if (before >= 0) {
      const Configuration& last = places_[static_cast<std::size_t>(before)];
      judge.difference(last.data(), q.data(), by.data());
      if (judge.free(last, by)) {
        join(before, here, judge.length(by.data()));
      }
    }
    // One move to another part, or to a place that only a detour leads to.
    for (const auto& [place, length] : near) {
      if (part_of(place) == part_of(here)) {
        continue;
      }
      judge.difference(q.data(), places_[static_cast<std::size_t>(place)].data(), by.data());
      if (judge.free(q, by)) {
        join(here, place, length);
      }
      break;
    }
    before = here;
  }
}

std::optional<std::vector<int>> KnownMoves::shortest(const Judge& judge, int from, int to) const {
  constexpr float far = std::numeric_limits<float>::infinity();
  std::vector<float> cost(places_.size(), far);
  std::vector<int> came(places_.size(), -1);
  std::vector<bool> done(places_.size(), false);
  using Entry = std::pair<float, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  Configuration by{};
  const auto rest = [&](int at) {
    judge.difference(places_[static_cast<std::size_t>(at)].data(),
                     places_[static_cast<std::size_t>(to)].data(), by.data());
    return judge.length(by.data());
  };
  cost[static_cast<std::size_t>(from)] = 0.0F;
  queue.emplace(rest(from), from);
  while (!queue.empty()) {
    const int at = queue.top().second;
    queue.pop();
    if (at == to) {
      std::vector<int> way;
      for (int i = to; i >= 0; i = came[static_cast<std::size_t>(i)]) {
        way.push_back(i);
      }
      std::reverse(way.begin(), way.end());
      return way;
    }
    if (done[static_cast<std::size_t>(at)]) {
      continue;
    }
    done[static_cast<std::size_t>(at)] = true;
    for (const Link& link : links_[static_cast<std::size_t>(at)]) {
      const auto next = static_cast<std::size_t>(link.to);
      const float length = cost[static_cast<std::size_t>(at)] + link.length;
      if (!done[next] && length < cost[next]) {
        cost[next] = length;
        came[next] = at;
        queue.emplace(length + rest(link.to), link.to);
      }
    }
  }
  return std::nullopt;
}

std::optional<ConfigurationPath> KnownMoves::way(Judge& judge, const double* start,
                                                 const double* goal) {
  if (places_.empty()) {
    return std::nullopt;
  }
  const int n = judge.dimension();
  const std::array<Configuration, 2> ends{rounded(start, n), rounded(goal, n)};
  const std::array<std::vector<NearPlace>, 2> exits{
      nearest_places(judge, places_, ends[0], most_exits),
      nearest_places(judge, places_, ends[1], most_exits)};
  std::array<std::vector<int>, 2> reached;
  Configuration by{};
  // In turns, the nearest first, until both reach one part.
  for (std::size_t k = 0; k < most_exits; ++k) {
    for (const std::size_t end : {0U, 1U}) {
      if (k >= exits[end].size()) {
        continue;
      }
      const int place = exits[end][k].place;
      const auto is_of_part = [&](int other) { return part_of(other) == part_of(place); };
      if (std::any_of(reached[end].begin(), reached[end].end(), is_of_part)) {
        continue;  // a nearer place of that part is reached
      }
      judge.difference(ends[end].data(), places_[static_cast<std::size_t>(place)].data(),
                       by.data());
      if (!judge.free(ends[end], by)) {
        continue;
      }
      reached[end].push_back(place);
      const auto other = std::find_if(reached[1 - end].begin(), reached[1 - end].end(), is_of_part);
      if (other == reached[1 - end].end()) {
        continue;
      }
      const auto way = end == 0 ? shortest(judge, place, *other) : shortest(judge, *other, place);
      if (!way) {
        return std::nullopt;
      }
      ConfigurationPath path;
      path.emplace_back(start, start + n);
      for (const int i : *way) {
        const Configuration& q = places_[static_cast<std::size_t>(i)];
        path.emplace_back(q.begin(), q.begin() + n);
      }
      path.emplace_back(goal, goal + n);
      path.erase(std::unique(path.begin(), path.end()), path.end());
      return path;
    }
  }
  return std::nullopt;
}

}  // namespace flyball::detail
