/* SPDX-License-Identifier: Apache-2.0
 *
 * peers.h: what every library here is asked to do: triangles in plain arrays become its mesh, edges are flipped until all are
 * locally Delaunay, and plain arrays come out. The three parts are timed apart.
 */
#ifndef DELMESH_BENCH_PEERS_H
#define DELMESH_BENCH_PEERS_H

#include <chrono>
#include <cstdint>
#include <vector>

/* An oriented manifold of triangles, every vertex used: what all of them accept. */
struct Triangles {
    std::vector<double> positions; /* x y z of each vertex */
    std::vector<int32_t> corners;  /* three vertices of each face */
    int64_t edge_count = 0;

    int64_t vertex_count() const { return int64_t(positions.size() / 3); }
    int64_t face_count() const { return int64_t(corners.size() / 3); }
};

/* A surface mesh has positions. An intrinsic triangulation has none for its faces, which are bent over the input: it has the
 * length of the edge from each corner to the next instead, and the number of that edge, since two may join the same vertices. */
struct Answer {
    std::vector<double> positions;
    std::vector<int32_t> corners;
    std::vector<double> lengths;
    std::vector<int32_t> edges;
    int64_t flips = -1; /* -1: it does not tell */
    bool want_flips = false;
    double seconds[3] = {}; /* structure, flips, arrays */
};

class Laps {
public:
    explicit Laps(Answer& answer) : answer_(answer), last_(Clock::now()) {}
    void lap() {
        const Clock::time_point time = Clock::now();
        answer_.seconds[at_++] = std::chrono::duration<double>(time - last_).count();
        last_ = time;
    }

private:
    using Clock = std::chrono::steady_clock;
    Answer& answer_;
    Clock::time_point last_;
    int at_ = 0;
};

struct Peer {
    const char* name;
    bool intrinsic;
    void (*run)(const Triangles&, Answer&); /* throws on failure */
};

/* Each file adds what its library offers. */
void add_delmesh(std::vector<Peer>& peers);
void add_geometry_central(std::vector<Peer>& peers);
void add_cgal(std::vector<Peer>& peers);
void add_libigl(std::vector<Peer>& peers);

#endif
