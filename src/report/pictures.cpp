#include <algorithm>
#include <exception>
#include <functional>
#include <system_error>
#include <thread>
#include <utility>

#include <flyball/io/plot.hpp>

#include "report/pictures.hpp"

namespace flyball::report {

namespace {

using Drawn = std::vector<Expected<std::string>>;

/// What one gnuplot draws: some of the figures, as SVG or PNG.
struct Batch {
  bool raster = false;
  std::vector<std::size_t> figures{};
  std::exception_ptr failure{};
};

void draw(Batch& batch, std::vector<Picture>& pictures, double seconds) {
  std::vector<const Plot*> plots;
  for (const std::size_t i : batch.figures) {
    plots.push_back(&pictures[i].figure.plot);
  }
  Drawn drawn = batch.raster ? render_pngs(plots, seconds) : render_svgs(plots, seconds);
  for (std::size_t k = 0; k < drawn.size(); ++k) {
    Picture& picture = pictures[batch.figures[k]];
    if (!drawn[k]) {
      (batch.raster ? picture.png_problem : picture.problem) = to_string(drawn[k].error());
    } else {
      (batch.raster ? picture.png : picture.svg) = *std::move(drawn[k]);
    }
  }
}

}  // namespace

std::vector<Picture> draw(const std::vector<Figure>& figures, bool png, double seconds) {
  std::vector<Picture> pictures(figures.size());
  // All SVGs take one gnuplot less than a tenth of a second; of PNGs each takes that, so that every
  // processor gets its share of them.
  const std::size_t raster_batches =
      png ? std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, 8) : 0;
  std::vector<Batch> batches(1 + raster_batches);
  for (std::size_t i = 0; i < figures.size(); ++i) {
    pictures[i].figure = figures[i];
    batches[0].figures.push_back(i);
    if (png) {
      batches[1 + i % raster_batches].figures.push_back(i);
    }
  }
  const auto work = [&](Batch& batch) {
    try {
      draw(batch, pictures, seconds);
    } catch (...) {
      batch.failure = std::current_exception();  // A thread that an exception leaves ends all.
    }
  };
  {
    std::vector<std::jthread> workers;
    for (std::size_t b = 1; b < batches.size(); ++b) {
      batches[b].raster = true;
      try {
        workers.emplace_back(work, std::ref(batches[b]));
      } catch (const std::system_error&) {
        work(batches[b]);  // The system has no more threads.
      }
    }
    work(batches[0]);
  }
  for (Batch& batch : batches) {
    if (batch.failure) {
      std::rethrow_exception(batch.failure);
    }
  }
  for (Picture& picture : pictures) {
    if (picture.problem.empty()) {
      picture.problem = std::move(picture.png_problem);
    }
  }
  return pictures;
}

}  // namespace flyball::report
