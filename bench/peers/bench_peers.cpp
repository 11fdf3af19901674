/* SPDX-License-Identifier: Apache-2.0
 *
 * bench_peers.cpp: the same work by delmesh and by the libraries that it was built with, on the same meshes in the same run.
 *     bench_peers [--repeat N] [--subdivide N] [--timeout SECONDS] [--only TEXT] FILE...
 * Files are read as the command reads them and imported by delmesh once, untimed: everyone, delmesh included, then begins with
 * the same arrays of an oriented manifold of triangles in float64. Timed: arrays to the library's mesh, the flips, the result to
 * arrays. What the libraries do beyond that, or do not do, is said at the head of each peer_*.cpp: those who work intrinsically
 * deliver no surface mesh, and only delmesh delivers a certificate.
 *
 * Every run is a process of its own, since some may crash or never end. The libraries take turns; each process does the work
 * twice, and the best time counts. Another process runs with a counter in the heap, and counts what is left in the result
 * (nld_count.h).
 */
#include "heap_count.h"
#include "nld_count.h"
#include "peers.h"

extern "C" {
#include "mesh_file.h"
#include "subdivide.h"
}

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <string>
#include <sys/wait.h>
#include <unistd.h>

namespace {

struct Settings {
    int repeat = 5, subdivide = 0;
    unsigned timeout = 120;
    std::string only;
};

/* What a child process sends back. */
struct Outcome {
    bool ok;
    double seconds[3];
    int64_t peak, flips, vertices;
    Count count;
    char message[200];

    double total() const { return seconds[0] + seconds[1] + seconds[2]; }
};

void work(const Peer& peer, const Triangles& mesh, bool measure_memory, Outcome& outcome) {
    if (measure_memory) {
        Answer answer;
        answer.want_flips = true;
        heap_count_begin();
        peer.run(mesh, answer);
        outcome.peak = heap_count_peak();
        outcome.flips = answer.flips;
        outcome.vertices = peer.intrinsic ? mesh.vertex_count() : int64_t(answer.positions.size() / 3);
        outcome.count = count_nld(answer);
    } else {
        for (int i = 0; i < 2; ++i) {
            Answer answer;
            peer.run(mesh, answer);
            if (i > 0 && answer.seconds[0] + answer.seconds[1] + answer.seconds[2] >= outcome.total()) continue;
            std::copy(answer.seconds, answer.seconds + 3, outcome.seconds);
        }
    }
    outcome.ok = true;
}

Outcome run_child(const Peer& peer, const Triangles& mesh, bool measure_memory, unsigned timeout) {
    Outcome outcome = {};
    int ends[2];
    fflush(stdout);
    if (pipe(ends) != 0) return outcome;
    const pid_t child = fork();
    if (child == 0) {
        close(ends[0]);
        alarm(timeout);
        try {
            work(peer, mesh, measure_memory, outcome);
        } catch (const std::exception& error) {
            snprintf(outcome.message, sizeof outcome.message, "%s", error.what());
        } catch (...) {
            snprintf(outcome.message, sizeof outcome.message, "unknown exception");
        }
        const ssize_t written = write(ends[1], &outcome, sizeof outcome);
        _exit(written == ssize_t(sizeof outcome) ? 0 : 1);
    }
    close(ends[1]);
    const bool heard = child > 0 && read(ends[0], &outcome, sizeof outcome) == ssize_t(sizeof outcome);
    close(ends[0]);
    int status = 0;
    if (child > 0) waitpid(child, &status, 0);
    if (!heard) {
        outcome = {};
        if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM)
            snprintf(outcome.message, sizeof outcome.message, "not ready after %u s", timeout);
        else
            snprintf(outcome.message, sizeof outcome.message, "crashed (%s)",
                     WIFSIGNALED(status) ? strsignal(WTERMSIG(status)) : "exit");
    }
    return outcome;
}

/* Through delmesh's import, which orients, cuts and triangulates; unused vertices are left out. */
bool import(const MeshFile& file, Triangles& mesh, const char* path) {
    delmesh_context* context = nullptr;
    delmesh_mesh* in = nullptr;
    delmesh_mesh_desc desc;
    delmesh_mesh_desc_init(&desc, sizeof desc);
    desc.positions = {file.positions, file.vertex_count, 0, file.precision, 3};
    desc.corner_verts = {file.corner_verts, file.corner_count, 0, DELMESH_INT32, 1};
    if (file.face_sizes != nullptr) desc.face_sizes = {file.face_sizes, file.face_count, 0, DELMESH_INT32, 1};
    delmesh_mesh_info info;
    delmesh_mesh_info_init(&info, sizeof info);
    delmesh_context_options options;
    delmesh_context_options_init(&options, sizeof options);
    options.max_threads = 1; /* children are forked: no threads here */
    int32_t status = delmesh_context_create(&options, &context);
    if (status == DELMESH_OK) status = delmesh_mesh_create(context, &desc, &in);
    if (status == DELMESH_OK) status = delmesh_mesh_get_info(in, &info);
    std::vector<double> positions(size_t(3 * info.vertices));
    mesh.corners.resize(size_t(info.corners));
    const delmesh_view_mut positions_out = {positions.data(), info.vertices, 0, DELMESH_FLOAT64, 3};
    const delmesh_view_mut corners_out = {mesh.corners.data(), info.corners, 0, DELMESH_INT32, 1};
    if (status == DELMESH_OK) status = delmesh_mesh_read(in, DELMESH_POSITION, &positions_out);
    if (status == DELMESH_OK) status = delmesh_mesh_read(in, DELMESH_CORNER_VERT, &corners_out);
    if (status != DELMESH_OK) fprintf(stderr, "%s: %s\n", path, delmesh_last_error(context));
    delmesh_mesh_destroy(in);
    delmesh_context_destroy(context);
    mesh.edge_count = info.edges;

    std::vector<int32_t> number(size_t(info.vertices), -1);
    for (const int32_t v : mesh.corners) number[size_t(v)] = 0;
    int32_t used = 0;
    for (size_t v = 0; v < number.size(); ++v) {
        if (number[v] < 0) continue;
        number[v] = used++;
        mesh.positions.insert(mesh.positions.end(), &positions[3 * v], &positions[3 * v] + 3);
    }
    for (int32_t& v : mesh.corners) v = number[size_t(v)];
    return status == DELMESH_OK;
}

bool load(const char* path, int subdivisions, Triangles& mesh) {
    Failure failure = {nullptr, ""};
    MeshFile file;
    if (!mesh_file_read(path, true, &file, &failure)) {
        fprintf(stderr, "%s\n", failure.text);
        return false;
    }
    bool ok = true;
    for (int i = 0; i < subdivisions && ok; ++i) ok = subdivide(&file);
    if (!ok) fprintf(stderr, "%s: no memory to subdivide, or too big\n", path);
    ok = ok && import(file, mesh, path);
    mesh_file_free(&file);
    return ok;
}

void print(const Peer& peer, const Triangles& mesh, const Outcome& best, const Outcome& counted) {
    printf("  %-31s", peer.name);
    if (!best.ok || !counted.ok) {
        printf(" %s\n", !best.ok ? best.message : counted.message);
        return;
    }
    const double scale = 1e9 / double(mesh.edge_count);
    printf(" %8.1f %8.1f %8.1f %8.1f %8.1f", scale * best.total(), scale * best.seconds[0], scale * best.seconds[1],
           scale * best.seconds[2], double(counted.peak) / double(mesh.face_count()));
    if (counted.flips >= 0)
        printf(" %8lld", (long long)counted.flips);
    else
        printf(" %8s", "?");
    printf(" %6lld %6lld %8.2g", (long long)(counted.vertices - mesh.vertex_count()), (long long)counted.count.nld,
           counted.count.worst);
    if (peer.intrinsic)
        printf(" %6s %5s\n", "-", "-");
    else
        printf(" %6lld %5lld\n", (long long)counted.count.crowded, (long long)counted.count.zero_area);
}

bool bench_file(const char* path, const std::vector<Peer>& peers, const Settings& settings) {
    Triangles mesh;
    if (!load(path, settings.subdivide, mesh)) return false;
    const Count before = count_nld({mesh.positions, mesh.corners, {}, {}});
    const char* const slash = strrchr(path, '/');
    printf("%s: %lld edges, %lld faces, %lld NLD edges (boundary left aside); best of %d x 2\n",
           slash != nullptr ? slash + 1 : path, (long long)mesh.edge_count, (long long)mesh.face_count(), (long long)before.nld,
           settings.repeat);
    printf("  %-31s %8s %8s %8s %8s %8s %8s %6s %6s %8s %6s %5s\n", "", "ns/edge", "build", "flip", "arrays", "B/tri", "flips",
           "added", "NLD", "degrees", "crowd", "flat");
    std::vector<Outcome> best(peers.size());
    for (int i = 0; i < settings.repeat; ++i)
        for (size_t p = 0; p < peers.size(); ++p) {
            if (i > 0 && !best[p].ok) continue;
            const Outcome outcome = run_child(peers[p], mesh, false, settings.timeout);
            if (i == 0 || !outcome.ok || outcome.total() < best[p].total()) best[p] = outcome;
        }
    for (size_t p = 0; p < peers.size(); ++p) {
        const Outcome counted = best[p].ok ? run_child(peers[p], mesh, true, 4 * settings.timeout) : Outcome{};
        print(peers[p], mesh, best[p], counted);
    }
    return true;
}

} // namespace

int main(int argc, char** argv) {
    Settings settings;
    int at = 1;
    for (; at + 1 < argc && argv[at][0] == '-'; at += 2) {
        const std::string name = argv[at];
        if (name == "--repeat")
            settings.repeat = std::max(1, atoi(argv[at + 1]));
        else if (name == "--subdivide")
            settings.subdivide = atoi(argv[at + 1]);
        else if (name == "--timeout")
            settings.timeout = unsigned(std::max(1, atoi(argv[at + 1])));
        else if (name == "--only")
            settings.only = argv[at + 1];
        else
            break;
    }
    if (at >= argc || argv[at][0] == '-') {
        fprintf(stderr, "usage: bench_peers [--repeat N] [--subdivide N] [--timeout SECONDS] [--only TEXT] FILE...\n");
        return 2;
    }
    std::vector<Peer> peers;
    add_delmesh(peers);
#ifdef BENCH_GEOMETRY_CENTRAL
    add_geometry_central(peers);
#endif
#ifdef BENCH_CGAL
    add_cgal(peers);
#endif
#ifdef BENCH_LIBIGL
    add_libigl(peers);
#endif
    std::erase_if(peers, [&](const Peer& peer) { return std::string(peer.name).find(settings.only) == std::string::npos; });
    int failed = 0;
    for (; at < argc; ++at) failed |= !bench_file(argv[at], peers, settings);
    return failed;
}
