// SPDX-License-Identifier: Apache-2.0
// The second opinion: decides whether a mesh file is Delaunay, and shares no code with the library or its command. It reads the
// file with its own readers, decides every sign with its own error bound or with GMP integers, and prints one JSON line.
//
//     dm_certifier [--boundary nonobtuse|ignore] [--f32] [--source FILE [--within R]] FILE
//
// --f32      rounds the coordinates of both files to float32 after reading them (PLY float and binary STL are float32 anyway)
// --source   also counts the vertices i of that file that are not vertex i of FILE, bit for bit (-0 and 0 are the same)
// --within   also counts sample points of either surface that are farther than R from the other (on --source as rounded by --f32)
// Formats: OBJ, OFF (text, and binary of either byte order), PLY (text, and binary of either byte order; faces or triangle
// strips), STL (both; corners at equal positions become one vertex). Polygons are cut into fans. Text numbers are read as doubles.
// Exit status: 0 the mesh is an oriented manifold, Delaunay, without a face of zero area; 1 it is not; 2 it could not be read.
#include <gmpxx.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <numeric>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace {

struct Point {
    double x[3];
};

struct Mesh {
    std::vector<Point> points;
    std::vector<int32_t> corners; // three per face
    size_t faces() const { return corners.size() / 3; }
};

// ---- Readers --------------------------------------------------------------------------------------------------------------

[[noreturn]] void bad(const std::string& what) {
    throw std::runtime_error(what);
}

double to_double(std::string_view word) {
    if (!word.empty() && word[0] == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (end != word.data() + word.size() || word.empty()) bad("no number: " + std::string(word));
    if (error == std::errc::result_out_of_range) return std::strtod(std::string(word).c_str(), nullptr); // 0 or infinity
    return value;
}

int64_t to_integer(std::string_view word) {
    int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) bad("no integer: " + std::string(word));
    return value;
}

// Words separated by blanks; '#' starts a comment where the format has them.
class Words {
public:
    Words(std::string_view text, bool comments) : text_(text), comments_(comments) {}
    bool next(std::string_view& word) {
        for (;;) {
            while (at_ < text_.size() && static_cast<unsigned char>(text_[at_]) <= ' ') ++at_;
            if (at_ == text_.size()) return false;
            if (!comments_ || text_[at_] != '#') break;
            while (at_ < text_.size() && text_[at_] != '\n') ++at_;
        }
        const size_t begin = at_;
        while (at_ < text_.size() && static_cast<unsigned char>(text_[at_]) > ' ') ++at_;
        word = text_.substr(begin, at_ - begin);
        return true;
    }
    std::string_view need() {
        std::string_view word;
        if (!next(word)) bad("the file ends too early");
        return word;
    }
    void skip_line() {
        while (at_ < text_.size() && text_[at_] != '\n') ++at_;
    }
    size_t position() const { return at_; }

private:
    std::string_view text_;
    bool comments_;
    size_t at_ = 0;
};

// Numbers in the bytes of a binary file.
class Bytes {
public:
    Bytes(std::string_view data, size_t at, bool big_endian) : data_(data), at_(at), swap_(big_endian) {}
    template <class T>
    T get() {
        if (data_.size() - at_ < sizeof(T)) bad("the file ends too early");
        char raw[sizeof(T)];
        std::memcpy(raw, data_.data() + at_, sizeof(T));
        if (swap_) std::reverse(raw, raw + sizeof(T));
        at_ += sizeof(T);
        T value;
        std::memcpy(&value, raw, sizeof(T));
        return value;
    }

private:
    std::string_view data_;
    size_t at_;
    bool swap_;
};

void add_polygon(Mesh& mesh, const std::vector<int64_t>& polygon) {
    for (const int64_t v : polygon)
        if (v < 0 || v >= INT32_MAX) bad("vertex index " + std::to_string(v) + " is out of range");
    for (size_t k = 2; k < polygon.size(); ++k)
        for (const int64_t v : {polygon[0], polygon[k - 1], polygon[k]}) mesh.corners.push_back(static_cast<int32_t>(v));
}

Mesh read_obj(std::string_view text) {
    Mesh mesh;
    std::vector<int64_t> polygon;
    size_t begin = 0;
    while (begin < text.size()) {
        const size_t end = std::min(text.find('\n', begin), text.size());
        Words words(text.substr(begin, end - begin), true);
        begin = end + 1;
        std::string_view word;
        if (!words.next(word)) continue;
        if (word == "v") {
            Point p;
            for (double& x : p.x) x = to_double(words.need());
            mesh.points.push_back(p);
        } else if (word == "f") {
            polygon.clear();
            while (words.next(word)) {
                const int64_t index = to_integer(word.substr(0, word.find('/')));
                polygon.push_back(index < 0 ? static_cast<int64_t>(mesh.points.size()) + index : index - 1);
            }
            add_polygon(mesh, polygon);
        }
    }
    return mesh;
}

Mesh read_off(std::string_view text) {
    Mesh mesh;
    std::vector<int64_t> polygon;
    Words words(text, true);
    std::string_view word = words.need();
    const bool colours = word == "COFF"; // behind each vertex, on its line
    if (word != "OFF" && !colours) bad("the first word is neither OFF nor COFF");
    word = words.need();
    if (word == "BINARY") {
        words.skip_line();
        const size_t at = words.position() + 1;
        // The byte order is the one in which the vertex count is the smaller number.
        const uint32_t little = Bytes(text, at, false).get<uint32_t>(), big = Bytes(text, at, true).get<uint32_t>();
        Bytes bytes(text, at, big < little);
        const int32_t points = bytes.get<int32_t>(), faces = bytes.get<int32_t>();
        bytes.get<int32_t>(); // edges, not used
        // Some writers put a count of colours behind each face, some do not: the size of a file of triangles tells.
        const bool face_colours = text.size() != at + 12 + 12 * static_cast<size_t>(points) + 16 * static_cast<size_t>(faces);
        for (int32_t v = 0; v < points; ++v) {
            Point p;
            for (double& x : p.x) x = bytes.get<float>();
            mesh.points.push_back(p);
        }
        for (int32_t f = 0; f < faces; ++f) {
            polygon.assign(static_cast<size_t>(std::clamp(bytes.get<int32_t>(), 0, 1 << 20)), 0);
            for (int64_t& v : polygon) v = bytes.get<int32_t>();
            for (int32_t n = face_colours ? bytes.get<int32_t>() : 0; n > 0; --n) bytes.get<float>();
            add_polygon(mesh, polygon);
        }
        return mesh;
    }
    const int64_t points = to_integer(word), faces = to_integer(words.need());
    words.need(); // edges, not used
    for (int64_t v = 0; v < points; ++v) {
        Point p;
        for (double& x : p.x) x = to_double(words.need());
        if (colours) words.skip_line();
        mesh.points.push_back(p);
    }
    for (int64_t f = 0; f < faces; ++f) {
        polygon.clear();
        for (int64_t n = to_integer(words.need()); n > 0; --n) polygon.push_back(to_integer(words.need()));
        words.skip_line(); // its colours
        add_polygon(mesh, polygon);
    }
    return mesh;
}

struct PlyProperty {
    std::string name, type, count_type; // count_type is empty for a scalar
};

double ply_number(Bytes& bytes, const std::string& type) {
    if (type == "float" || type == "float32") return bytes.get<float>();
    if (type == "double" || type == "float64") return bytes.get<double>();
    if (type == "char" || type == "int8") return bytes.get<int8_t>();
    if (type == "uchar" || type == "uint8") return bytes.get<uint8_t>();
    if (type == "short" || type == "int16") return bytes.get<int16_t>();
    if (type == "ushort" || type == "uint16") return bytes.get<uint16_t>();
    if (type == "int" || type == "int32") return bytes.get<int32_t>();
    if (type == "uint" || type == "uint32") return bytes.get<uint32_t>();
    bad("unknown PLY type " + type);
}

Mesh read_ply(std::string_view text) {
    struct Element {
        std::string name;
        int64_t count;
        std::vector<PlyProperty> properties;
    };
    std::vector<Element> elements;
    std::string format;
    size_t at = 0;
    for (;;) {
        const size_t end = text.find('\n', at);
        if (end == std::string_view::npos) bad("the PLY header has no end");
        std::istringstream line{std::string(text.substr(at, end - at))};
        at = end + 1;
        std::string word;
        line >> word;
        if (word == "format") line >> format;
        if (word == "element") {
            Element e{};
            line >> e.name >> e.count;
            elements.push_back(e);
        }
        if (word == "property") {
            if (elements.empty()) bad("a PLY property before the first element");
            PlyProperty p;
            line >> p.type;
            if (p.type == "list") line >> p.count_type >> p.type;
            line >> p.name;
            elements.back().properties.push_back(p);
        }
        if (word == "end_header") break;
    }
    const bool is_text = format == "ascii";
    if (!is_text && format != "binary_little_endian" && format != "binary_big_endian") bad("unknown PLY format " + format);
    Words words(is_text ? text.substr(at) : std::string_view(), false);
    Bytes bytes(text, at, format == "binary_big_endian");
    auto number = [&](const std::string& type) { return is_text ? to_double(words.need()) : ply_number(bytes, type); };
    Mesh mesh;
    std::vector<int64_t> list;
    for (const Element& element : elements)
        for (int64_t i = 0; i < element.count; ++i) {
            Point p{};
            for (const PlyProperty& property : element.properties) {
                if (property.count_type.empty()) {
                    const double x = number(property.type);
                    if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z')
                        p.x[property.name[0] - 'x'] = x;
                    continue;
                }
                list.clear();
                for (auto n = static_cast<int64_t>(number(property.count_type)); n > 0; --n)
                    list.push_back(static_cast<int64_t>(number(property.type)));
                if (element.name == "face" && (property.name == "vertex_indices" || property.name == "vertex_index"))
                    add_polygon(mesh, list);
                if (element.name == "tristrips") {
                    size_t start = 0; // of the strip; every second triangle is turned over
                    for (size_t k = 0; k < list.size(); ++k) {
                        if (list[k] < 0) start = k + 1;
                        if (k < start + 2) continue;
                        const int64_t a = list[k - 2], b = list[k - 1], c = list[k];
                        if (a == b || b == c || c == a) continue;
                        add_polygon(mesh, (k - start) % 2 == 0 ? std::vector{a, b, c} : std::vector{b, a, c});
                    }
                }
            }
            if (element.name == "vertex") mesh.points.push_back(p);
        }
    return mesh;
}

Mesh read_stl(std::string_view text) {
    std::vector<Point> soup;
    const bool is_text = text.substr(0, 5) == "solid" && text.find("facet") != std::string_view::npos &&
                         (text.size() < 84 || text.size() != 84 + 50 * uint64_t{Bytes(text, 80, false).get<uint32_t>()});
    if (is_text) {
        Words words(text, false);
        std::string_view word;
        while (words.next(word)) {
            if (word != "vertex") continue;
            Point p;
            for (double& x : p.x) x = to_double(words.need());
            soup.push_back(p);
        }
    } else {
        Bytes bytes(text, std::min<size_t>(80, text.size()), false);
        for (uint32_t faces = bytes.get<uint32_t>(); faces > 0; --faces) {
            for (int k = 0; k < 3; ++k) bytes.get<float>(); // normal
            for (int k = 0; k < 3; ++k) {
                Point p;
                for (double& x : p.x) x = bytes.get<float>();
                soup.push_back(p);
            }
            bytes.get<uint16_t>();
        }
    }
    if (soup.size() % 3 != 0) bad("an STL facet has not three vertices");
    Mesh mesh;
    struct Hash {
        size_t operator()(const Point& p) const {
            uint64_t h = 0;
            for (const double x : p.x) h = (h ^ std::bit_cast<uint64_t>(x)) * 0x9E3779B97F4A7C15u, h ^= h >> 29;
            return h;
        }
    };
    auto equal = [](const Point& a, const Point& b) { return std::memcmp(a.x, b.x, sizeof a.x) == 0; };
    std::unordered_map<Point, int32_t, Hash, decltype(equal)> seen(soup.size(), Hash(), equal);
    for (Point& p : soup) {
        for (double& x : p.x)
            if (x == 0) x = 0; // -0 and 0 are one place
        const auto [it, fresh] = seen.try_emplace(p, static_cast<int32_t>(mesh.points.size()));
        if (fresh) mesh.points.push_back(p);
        mesh.corners.push_back(it->second);
    }
    return mesh;
}

Mesh read_mesh(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) bad("cannot open the file");
    std::string text{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    std::string extension = path.substr(std::min(path.rfind('.'), path.size()));
    for (char& c : extension) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c);
    if (extension == ".obj") return read_obj(text);
    if (extension == ".off") return read_off(text);
    if (extension == ".ply") return read_ply(text);
    if (extension == ".stl") return read_stl(text);
    bad("unknown extension " + extension);
}

// ---- Signs ----------------------------------------------------------------------------------------------------------------
// For an apex o and the ends p, q of the opposite edge: u = p - o, v = q - o, d = u.v, S = |u x v|^2. An interior edge with
// values 1 and 2 is not locally Delaunay (NLD) when sqrt(S1) d2 + sqrt(S2) d1 < 0, or when both faces have zero area and both
// d < 0. So: both d >= 0: not NLD. Both d < 0: NLD. Otherwise, with d1 < 0 <= d2: NLD exactly when S1 d2^2 < S2 d1^2.
//
// Filter. Coordinates are scaled by a power of two to below 1, so all that follows is below 2^40. With e = 2^-53, and magnitudes
// that bound each sum by its absolute terms, D = sum |u_i v_i| and M_k = |u_i v_j| + |u_j v_i|:
//   one difference has the relative error e; a product of two, their rounding and three additions: |d' - d| <= 6 e D
//   a component of the cross product: |c' - c| <= 5 e M, its square 11 e M^2, their sum: |S' - S| <= 16 e T, T = sum M_k^2
//   L = S1 d2^2: |L' - L| <= (16 + 2 * 6 + 3) e T1 D2^2, all computed in double: below 40 e T1 D2^2
// Every constant is doubled below for second-order terms and the rounding of the bounds themselves. Underflow adds at most 2^-1074
// per operation, times factors below 2^40: less than kTiny.

constexpr double kEps = 0x1p-53, kTiny = 0x1p-900;

struct Corner { // of one face, at an apex
    double d, D, S, T;
};

Corner corner(const Point& o, const Point& p, const Point& q) {
    double u[3], v[3];
    for (int i = 0; i < 3; ++i) u[i] = p.x[i] - o.x[i], v[i] = q.x[i] - o.x[i];
    Corner c{0, 0, 0, 0};
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        c.d += u[i] * v[i];
        c.D += std::fabs(u[i] * v[i]);
        const double a = u[i] * v[j], b = u[j] * v[i], m = std::fabs(a) + std::fabs(b);
        c.S += (a - b) * (a - b);
        c.T += m * m;
    }
    return c;
}

// -1, +1, or 0 for "cannot tell".
int filtered_sign(double value, double bound) {
    return value > bound ? 1 : value < -bound ? -1 : 0;
}
int filtered_d(const Corner& c) {
    return filtered_sign(c.d, 12 * kEps * c.D + kTiny);
}

class Certifier {
public:
    Certifier(const Mesh& mesh) : mesh_(mesh), scaled_(mesh.points) {
        double largest = 0;
        for (const Point& p : mesh.points)
            for (const double x : p.x)
                if (std::isfinite(x)) largest = std::max(largest, std::fabs(x));
        int exponent = 0;
        std::frexp(largest, &exponent);
        for (Point& p : scaled_)
            for (double& x : p.x) x = std::ldexp(x, -exponent);
    }

    // face: corners o, p, q. Is its area exactly zero?
    bool zero_area(int32_t o, int32_t p, int32_t q) {
        const Corner c = corner(scaled_[o], scaled_[p], scaled_[q]);
        if (c.S > 32 * kEps * c.T + kTiny) return false;
        const Exact e = exact_corners({o, o, p, q}, 1)[0];
        return sgn(e.S) == 0;
    }

    // the angle at o, opposite to the boundary edge p q
    bool obtuse(int32_t o, int32_t p, int32_t q) {
        const int sign = filtered_d(corner(scaled_[o], scaled_[p], scaled_[q]));
        if (sign != 0) return sign < 0;
        return sgn(exact_corners({o, o, p, q}, 1)[0].d) < 0;
    }

    // the edge p q of the faces with apexes o1 and o2
    bool nld(int32_t o1, int32_t o2, int32_t p, int32_t q) {
        Corner c1 = corner(scaled_[o1], scaled_[p], scaled_[q]), c2 = corner(scaled_[o2], scaled_[p], scaled_[q]);
        int sign1 = filtered_d(c1), sign2 = filtered_d(c2);
        if (sign1 > 0 && sign2 > 0) return false;
        if (sign1 < 0 && sign2 < 0) return true;
        if (sign1 != 0 && sign2 != 0) {
            if (sign1 > 0) std::swap(c1, c2); // now d1 < 0 < d2
            const double left = c1.S * (c2.d * c2.d), right = c2.S * (c1.d * c1.d);
            const double bound = 80 * kEps * (c1.T * (c2.D * c2.D) + c2.T * (c1.D * c1.D)) + kTiny;
            const int sign = filtered_sign(left - right, bound);
            if (sign != 0) return sign < 0;
        }
        const std::vector<Exact> e = exact_corners({o1, o2, p, q}, 2);
        if (sgn(e[0].d) >= 0 && sgn(e[1].d) >= 0) return false;
        if (sgn(e[0].d) < 0 && sgn(e[1].d) < 0) return true;
        const Exact &a = sgn(e[0].d) < 0 ? e[0] : e[1], &b = sgn(e[0].d) < 0 ? e[1] : e[0];
        return a.S * b.d * b.d < b.S * a.d * a.d;
    }

    int64_t exact_tests() const { return exact_tests_; }

private:
    struct Exact {
        mpz_class d, S;
    };

    // points: two apexes and the two ends of the edge. All twelve coordinates as integers in one common power of two.
    std::vector<Exact> exact_corners(const std::vector<int32_t>& points, size_t apexes) {
        ++exact_tests_;
        int64_t mantissa[4][3];
        int exponent[4][3], lowest = INT32_MAX;
        for (int i = 0; i < 4; ++i)
            for (int k = 0; k < 3; ++k) {
                mantissa[i][k] = static_cast<int64_t>(std::ldexp(std::frexp(mesh_.points[points[i]].x[k], &exponent[i][k]), 53));
                if (mantissa[i][k] != 0) lowest = std::min(lowest, exponent[i][k]);
            }
        mpz_class x[4][3];
        for (int i = 0; i < 4; ++i)
            for (int k = 0; k < 3; ++k)
                if (mantissa[i][k] != 0) x[i][k] = mpz_class(static_cast<long>(mantissa[i][k])) << (exponent[i][k] - lowest);
        std::vector<Exact> result(apexes);
        for (size_t a = 0; a < apexes; ++a) {
            mpz_class u[3], v[3];
            for (int k = 0; k < 3; ++k) u[k] = x[2][k] - x[a][k], v[k] = x[3][k] - x[a][k];
            result[a].d = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
            for (int k = 0; k < 3; ++k) {
                const int j = (k + 1) % 3;
                const mpz_class c = u[k] * v[j] - u[j] * v[k];
                result[a].S += c * c;
            }
        }
        return result;
    }

    const Mesh& mesh_;
    std::vector<Point> scaled_; // for the filter only
    int64_t exact_tests_ = 0;
};

// ---- The mesh as a whole ----------------------------------------------------------------------------------------------------

size_t next(size_t corner) {
    return corner % 3 == 2 ? corner - 2 : corner + 1;
}
size_t prev(size_t corner) {
    return corner % 3 == 0 ? corner + 2 : corner - 1;
}

struct Sets { // union-find
    std::vector<int32_t> parent;
    explicit Sets(size_t n) : parent(n) { std::iota(parent.begin(), parent.end(), 0); }
    int32_t find(int32_t a) {
        while (parent[a] != a) a = parent[a] = parent[parent[a]];
        return a;
    }
    bool join(int32_t a, int32_t b) {
        a = find(a), b = find(b);
        parent[b] = a;
        return a != b;
    }
};

struct Answer {
    int64_t vertices = 0, faces = 0, edges = 0, boundary_edges = 0, components = 0, boundary_loops = 0, euler_characteristic = 0,
            nld_interior = 0, nld_boundary = 0, zero_area_faces = 0, nonmanifold_edges = 0, nonmanifold_vertices = 0,
            misoriented_edges = 0, exact_tests = 0;
    double area = 0;
    bool delaunay = false;
};

void check(const Mesh& mesh) {
    for (size_t c = 0; c < mesh.corners.size(); ++c) {
        const auto v = static_cast<size_t>(mesh.corners[c]);
        if (v >= mesh.points.size())
            bad("vertex index " + std::to_string(v) + " of face " + std::to_string(c / 3) + " is out of range");
        for (const double x : mesh.points[v].x)
            if (!std::isfinite(x)) bad("vertex " + std::to_string(v) + " is not finite");
    }
}

Answer certify(const Mesh& mesh, bool ignore_boundary) {
    Answer r;
    const size_t corners = mesh.corners.size();
    const std::vector<int32_t>& vert = mesh.corners;
    r.vertices = static_cast<int64_t>(mesh.points.size());
    r.faces = static_cast<int64_t>(mesh.faces());
    check(mesh);
    Certifier exact(mesh);
    long double area = 0;
    for (size_t c = 0; c < corners; c += 3) {
        if (exact.zero_area(vert[c], vert[c + 1], vert[c + 2])) ++r.zero_area_faces;
        const Point &o = mesh.points[vert[c]], &p = mesh.points[vert[c + 1]], &q = mesh.points[vert[c + 2]];
        long double square = 0;
        for (int i = 0; i < 3; ++i) {
            const int j = (i + 1) % 3;
            const long double n = (static_cast<long double>(p.x[i]) - o.x[i]) * (static_cast<long double>(q.x[j]) - o.x[j]) -
                                  (static_cast<long double>(p.x[j]) - o.x[j]) * (static_cast<long double>(q.x[i]) - o.x[i]);
            square += n * n;
        }
        area += std::sqrt(square) / 2;
    }
    r.area = static_cast<double>(area);

    // Corners by the edge that starts there, as (smaller vertex, larger vertex).
    std::vector<uint64_t> key(corners);
    std::vector<uint32_t> order(corners);
    {
        std::vector<uint32_t> start(mesh.points.size() + 1);
        for (size_t c = 0; c < corners; ++c) {
            const auto [low, high] = std::minmax(vert[c], vert[next(c)]);
            key[c] = static_cast<uint64_t>(low) << 32 | static_cast<uint32_t>(high);
            ++start[low + 1];
        }
        std::partial_sum(start.begin(), start.end(), start.begin());
        for (size_t c = 0; c < corners; ++c) order[start[key[c] >> 32]++] = static_cast<uint32_t>(c);
        for (size_t v = 0, begin = 0; v < mesh.points.size(); begin = start[v++]) // start[v] is now the end of v's group
            std::sort(order.begin() + static_cast<int64_t>(begin), order.begin() + start[v],
                      [&](uint32_t a, uint32_t b) { return key[a] != key[b] ? key[a] < key[b] : a < b; });
    }
    constexpr int64_t kNone = -1;
    std::vector<int64_t> twin(corners, kNone);
    Sets components(mesh.faces());
    r.components = r.faces;
    for (size_t begin = 0, end; begin < corners; begin = end) {
        for (end = begin; end < corners && key[order[end]] == key[order[begin]];) ++end;
        const size_t a = order[begin];
        ++r.edges;
        for (size_t k = begin + 1; k < end; ++k)
            if (components.join(static_cast<int32_t>(a / 3), static_cast<int32_t>(order[k] / 3))) --r.components;
        if (end - begin > 2 || vert[a] == vert[next(a)]) {
            ++r.nonmanifold_edges;
        } else if (end - begin == 1) {
            ++r.boundary_edges;
            if (exact.obtuse(vert[prev(a)], vert[a], vert[next(a)])) ++r.nld_boundary;
        } else {
            const size_t b = order[begin + 1];
            if (vert[a] == vert[b]) ++r.misoriented_edges;
            twin[a] = static_cast<int64_t>(b), twin[b] = static_cast<int64_t>(a);
            if (exact.nld(vert[prev(a)], vert[prev(b)], vert[a], vert[next(a)])) ++r.nld_interior;
        }
    }
    r.exact_tests = exact.exact_tests();

    std::vector<char> used(mesh.points.size(), 0);
    for (const int32_t v : vert) used[v] = 1;
    r.euler_characteristic = std::accumulate(used.begin(), used.end(), int64_t{0}) - r.edges + r.faces;

    if (r.nonmanifold_edges == 0 && r.misoriented_edges == 0) {
        // Fans: corners of one vertex that are joined through its edges. A manifold vertex has one.
        Sets fans(corners);
        int64_t fan_count = static_cast<int64_t>(corners);
        for (size_t c = 0; c < corners; ++c) // c and the corner after its twin are at the same vertex
            if (twin[c] != kNone && fans.join(static_cast<int32_t>(c), static_cast<int32_t>(next(static_cast<size_t>(twin[c])))))
                --fan_count;
        r.nonmanifold_vertices = fan_count - std::accumulate(used.begin(), used.end(), int64_t{0});
        // Loops: from a boundary edge, turn around its end to the next one.
        std::vector<char> seen(corners, 0);
        for (size_t c = 0; c < corners; ++c) {
            if (twin[c] != kNone || seen[c]) continue;
            ++r.boundary_loops;
            for (size_t at = c; !seen[at];) {
                seen[at] = 1;
                at = next(at);
                while (twin[at] != kNone) at = next(static_cast<size_t>(twin[at]));
            }
        }
    }
    r.delaunay = r.nld_interior == 0 && (ignore_boundary || r.nld_boundary == 0) && r.zero_area_faces == 0 &&
                 r.nonmanifold_edges == 0 && r.nonmanifold_vertices == 0 && r.misoriented_edges == 0;
    return r;
}

void round_to_f32(Mesh& mesh) {
    for (Point& p : mesh.points)
        for (double& x : p.x) {
            volatile float rounded = static_cast<float>(x); // volatile: the compiler must not drop the rounding
            x = rounded;
        }
}

// Vertices of `source` that `mesh` does not have at the same index.
int64_t moved_vertices(const Mesh& mesh, const Mesh& source) {
    int64_t moved = 0;
    for (size_t v = 0; v < source.points.size(); ++v) {
        bool same = v < mesh.points.size();
        for (int k = 0; k < 3 && same; ++k) {
            const double a = mesh.points[v].x[k], b = source.points[v].x[k];
            same = a == b || (std::isnan(a) && std::isnan(b));
        }
        if (!same) ++moved;
    }
    return moved;
}

// ---- Distance -------------------------------------------------------------------------------------------------------------
// Of sample points to a surface, in 113-bit arithmetic: in double, the distance to a sliver can be wrong by far more than the few
// units in the last place that are to be told apart here.

using Real = __float128;

struct RealPoint {
    Real x[3];
};

Real dot(const RealPoint& a, const RealPoint& b) {
    return a.x[0] * b.x[0] + a.x[1] * b.x[1] + a.x[2] * b.x[2];
}
RealPoint minus(const RealPoint& a, const RealPoint& b) {
    return {{a.x[0] - b.x[0], a.x[1] - b.x[1], a.x[2] - b.x[2]}};
}

Real squared_distance_to_segment(const RealPoint& p, const RealPoint& a, const RealPoint& b) {
    const RealPoint u = minus(b, a), w = minus(p, a);
    const Real square = dot(u, u);
    const Real t = square > 0 ? std::clamp<Real>(dot(u, w) / square, 0, 1) : 0;
    const RealPoint rest{{w.x[0] - t * u.x[0], w.x[1] - t * u.x[1], w.x[2] - t * u.x[2]}};
    return dot(rest, rest);
}

Real squared_distance_to_triangle(const RealPoint& p, const RealPoint& a, const RealPoint& b, const RealPoint& c) {
    const RealPoint u = minus(b, a), v = minus(c, a), w = minus(p, a);
    const Real uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w), area = uu * vv - uv * uv;
    if (area > 0) {
        const Real s = (vv * uw - uv * vw) / area, t = (uu * vw - uv * uw) / area;
        if (s >= 0 && t >= 0 && s + t <= 1) {
            const RealPoint rest{
                {w.x[0] - s * u.x[0] - t * v.x[0], w.x[1] - s * u.x[1] - t * v.x[1], w.x[2] - s * u.x[2] - t * v.x[2]}};
            return dot(rest, rest);
        }
    }
    return std::min(
        {squared_distance_to_segment(p, a, b), squared_distance_to_segment(p, b, c), squared_distance_to_segment(p, c, a)});
}

// Points of `from`, one inside each face and the faces' vertices, at most some thousands, that are farther than `reach` from `to`.
int64_t far_samples(const Mesh& from, const Mesh& to, double reach) {
    constexpr size_t kMostSamples = 8000;
    auto real = [](const Point& p) { return RealPoint{{p.x[0], p.x[1], p.x[2]}}; };
    // Triangles of `to` by their smallest x, with boxes that are wider by `reach`.
    struct Box {
        double low[3], high[3];
        size_t face;
    };
    std::vector<Box> boxes(to.faces());
    double widest = 0;
    for (size_t f = 0; f < to.faces(); ++f) {
        Box& box = boxes[f];
        box.face = f;
        for (int i = 0; i < 3; ++i) {
            const double x[3] = {to.points[to.corners[3 * f]].x[i], to.points[to.corners[3 * f + 1]].x[i],
                                 to.points[to.corners[3 * f + 2]].x[i]};
            box.low[i] = std::min({x[0], x[1], x[2]}) - 2 * reach; // twice: the rounding of this line
            box.high[i] = std::max({x[0], x[1], x[2]}) + 2 * reach;
        }
        widest = std::max(widest, box.high[0] - box.low[0]);
    }
    std::sort(boxes.begin(), boxes.end(), [](const Box& a, const Box& b) { return a.low[0] < b.low[0]; });
    std::minstd_rand random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    int64_t far = 0;
    for (size_t k = 0, step = std::max<size_t>(1, 2 * from.faces() / kMostSamples); k < 2 * from.faces(); k += step) {
        const size_t f = k / 2;
        RealPoint p = real(from.points[from.corners[3 * f + k % 3]]);
        if (k % 2 == 0) {
            double s = uniform(random), t = uniform(random);
            if (s + t > 1) s = 1 - s, t = 1 - t;
            const RealPoint a = p, b = real(from.points[from.corners[3 * f + (k + 1) % 3]]),
                            c = real(from.points[from.corners[3 * f + (k + 2) % 3]]);
            for (int i = 0; i < 3; ++i) p.x[i] = a.x[i] + s * (b.x[i] - a.x[i]) + t * (c.x[i] - a.x[i]);
        }
        const double at[3] = {static_cast<double>(p.x[0]), static_cast<double>(p.x[1]), static_cast<double>(p.x[2])};
        bool near = false;
        auto box =
            std::lower_bound(boxes.begin(), boxes.end(), at[0] - widest, [](const Box& b, double x) { return b.low[0] < x; });
        for (; !near && box != boxes.end() && box->low[0] <= at[0]; ++box) {
            bool hit = true;
            for (int i = 0; i < 3; ++i) hit = hit && box->low[i] <= at[i] && at[i] <= box->high[i];
            if (!hit) continue;
            const int32_t* v = &to.corners[3 * box->face];
            near = squared_distance_to_triangle(p, real(to.points[v[0]]), real(to.points[v[1]]), real(to.points[v[2]])) <=
                   static_cast<Real>(reach) * reach;
        }
        if (!near) ++far;
    }
    return far;
}

} // namespace

int main(int argc, char** argv) {
    bool ignore_boundary = false, f32 = false;
    double within = -1;
    std::string path, source_path;
    for (int i = 1; i < argc; ++i) {
        const std::string_view word = argv[i];
        const std::string_view value = i + 1 < argc ? argv[i + 1] : "";
        if (word == "--boundary" && (value == "ignore" || value == "nonobtuse")) {
            ignore_boundary = value == "ignore";
            ++i;
        } else if (word == "--f32") {
            f32 = true;
        } else if (word == "--source" && !value.empty()) {
            source_path = value;
            ++i;
        } else if (word == "--within" && !value.empty()) {
            within = to_double(value);
            ++i;
        } else if (path.empty() && word.substr(0, 2) != "--") {
            path = word;
        } else {
            path.clear();
            break;
        }
    }
    if (path.empty()) {
        std::fprintf(stderr, "usage: dm_certifier [--boundary nonobtuse|ignore] [--f32] [--source FILE [--within R]] FILE\n");
        return 2;
    }
    try {
        Mesh mesh = read_mesh(path);
        if (f32) round_to_f32(mesh);
        const Answer r = certify(mesh, ignore_boundary);
        int64_t moved = -1, far = -1;
        if (!source_path.empty()) {
            Mesh source = read_mesh(source_path);
            if (f32) round_to_f32(source);
            moved = moved_vertices(mesh, source);
            if (within >= 0) {
                check(source);
                far = far_samples(mesh, source, within) + far_samples(source, mesh, within);
            }
        }
        char area[32] = "null"; // beyond the range of double
        if (std::isfinite(r.area)) std::snprintf(area, sizeof area, "%.17g", r.area);
        auto number = [](int64_t n) { return static_cast<long long>(n); };
        std::printf("{\"vertices\": %lld, \"faces\": %lld, \"edges\": %lld, \"boundary_edges\": %lld, \"components\": %lld, "
                    "\"boundary_loops\": %lld, \"euler_characteristic\": %lld, \"nld_interior\": %lld, \"nld_boundary\": %lld, "
                    "\"zero_area_faces\": %lld, \"nonmanifold_edges\": %lld, \"nonmanifold_vertices\": %lld, "
                    "\"misoriented_edges\": %lld, \"exact_tests\": %lld, \"area\": %s, \"moved_vertices\": %lld, "
                    "\"far_samples\": %lld, \"delaunay\": %s}\n",
                    number(r.vertices), number(r.faces), number(r.edges), number(r.boundary_edges), number(r.components),
                    number(r.boundary_loops), number(r.euler_characteristic), number(r.nld_interior), number(r.nld_boundary),
                    number(r.zero_area_faces), number(r.nonmanifold_edges), number(r.nonmanifold_vertices),
                    number(r.misoriented_edges), number(r.exact_tests), area, number(moved), number(far),
                    r.delaunay ? "true" : "false");
        return r.delaunay ? 0 : 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "dm_certifier: %s: %s\n", path.c_str(), error.what());
        return 2;
    }
}
