! SPDX-License-Identifier: MIT
!> Models to measure: a wall, a layered roof, a tunnel in jointed rock, a random slope, one sliding block.
!>
!> Units: m, kg, s, N, per metre of thickness. Rock and contact stiffness are those of a published tunnel study:
!> 2500 kg/m2, nu = 0.25, g0 = 1e9, E = g0/softness (1e10 by default); dt follows from the stiffness ratio
!> g0/(2m/dt^2).
module bench_models
   use rockdda_base_kinds, only : wp, i8, pi
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_model_blocks, only : block_system_type, point_set_type
   use rockdda_model_analysis_input, only : analysis_input_type, dialect
   use rockdda_model_geometry_input, only : geometry_input_type
   use rockdda_model_options, only : run_options_type
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_resolve, only : resolve_parameters
   use rockdda_cutting_cut, only : cut_blocks, cut_report_type
   implicit none
   private
   public :: make_model, model_names

   character(len=*), parameter :: model_names = 'wall, roof, tunnel, slope, slide'

   real(wp), parameter :: density = 2500, g = 9.81_wp, stiffness = 1.0e9_wp
   real(wp), parameter :: brick(2) = [1.0_wp, 0.5_wp]   !! length, height

   !> A reproducible stream of numbers in [0, 1).
   type :: random_type
      integer(i8) :: state = 4711
   contains
      procedure :: next
   end type random_type

   !> Growing list of lines to cut.
   type :: drawing_type
      integer :: n = 0
      real(wp), allocatable :: lines(:, :)   !! (4, >= n)
   contains
      procedure :: add => add_line
      procedure :: add_inside
   end type drawing_type

contains

   !> Blocks and parameters of a model of about n blocks.
   subroutine make_model(name, n, ratio, softness, options, blocks, parameters, error)
      character(len=*), intent(in) :: name             !! one of `model_names`
      integer, intent(in) :: n                         !! approximate number of blocks
      real(wp), intent(in) :: ratio                    !! wall: stiffness over 2m/dt^2
      real(wp), intent(in) :: softness                 !! contact stiffness over E
      type(run_options_type), intent(in) :: options    !! override the values of the model
      type(block_system_type), intent(out) :: blocks
      type(parameters_type), intent(out) :: parameters
      type(error_type), allocatable, intent(out) :: error
      type(analysis_input_type) :: analysis
      type(diagnostics_type) :: messages

      analysis%dialect = dialect%g0
      analysis%n_steps = huge(1)
      analysis%stiffness = stiffness
      allocate (analysis%block_materials(1), analysis%joint_materials(1))
      analysis%block_materials%density = density
      analysis%block_materials%weight = density*g
      analysis%block_materials%youngs_modulus = stiffness/softness
      analysis%block_materials%poisson_ratio = 0.25_wp
      analysis%joint_materials%friction_angle = 35
      analysis%displacement_ratio = 0.01_wp
      select case (name)
      case ('wall')
         analysis%k01 = 0
         analysis%dt_max = sqrt(ratio*2*density*product(brick)/stiffness)
         call make_wall(n, blocks)
      case ('roof')
         analysis%k01 = 0
         analysis%dt_max = 0.01_wp
         analysis%block_materials(1)%stress = [-2.0e6_wp, 0.0_wp, 0.0_wp]
         analysis%joint_materials(1)%friction_angle = 40
         call make_roof(n, blocks, error)
      case ('tunnel')
         analysis%k01 = 1
         analysis%dt_max = 4.0e-4_wp
         analysis%displacement_ratio = 2.0e-4_wp
         analysis%joint_materials(1)%friction_angle = 20
         call make_tunnel(blocks, error)
      case ('slope')
         analysis%k01 = 1
         analysis%dt_max = 1.0e-3_wp
         analysis%joint_materials(1)%friction_angle = 25
         call make_slope(n, blocks, error)
      case ('slide')
         analysis%k01 = 1
         analysis%dt_max = 5.0e-3_wp
         analysis%joint_materials(1)%friction_angle = 20
         call make_slide(blocks, error)
      case default
         call make_error(error, error_code%input, "unknown model '"//name//"', expected one of "//model_names)
      end select
      if (allocated(error)) return
      call resolve_parameters(blocks, analysis, options, parameters, messages)
   end subroutine make_model

   !> Bricks in running bond, with half bricks at the ends of every other course, twice as long as high, on one fixed
   !> base block.
   subroutine make_wall(n, blocks)
      integer, intent(in) :: n
      type(block_system_type), intent(out) :: blocks
      integer :: columns, courses, i, j, b
      real(wp) :: left, right
      courses = max(2, nint(sqrt(0.5_wp*n*brick(1)/brick(2))))
      columns = max(2, nint((n - 1 - courses/2)/real(courses, wp)))
      b = 1 + columns*courses + courses/2
      call start_blocks(blocks, b)
      b = 0
      call add_rectangle(-1.0_wp, -1.0_wp, columns*brick(1) + 1, 0.0_wp)
      do j = 1, courses
         do i = 1, columns + merge(1, 0, mod(j, 2) == 0)
            left = (i - 1)*brick(1)
            if (mod(j, 2) == 0) left = max(0.0_wp, left - 0.5_wp*brick(1))
            right = min(i*brick(1), columns*brick(1))
            if (mod(j, 2) == 0) right = min(right - 0.5_wp*brick(1), columns*brick(1))
            if (mod(j, 2) == 0 .and. i == columns + 1) right = columns*brick(1)
            call add_rectangle(left, (j - 1)*brick(2), right, j*brick(2))
         end do
      end do
      call set_points(blocks%fixed, blocks%vertices(:, 1:4), [1, 1, 1, 1])

   contains

      !> Append a block with corners at the ends of a diagonal.
      subroutine add_rectangle(x1, y1, x2, y2)
         real(wp), intent(in) :: x1, y1, x2, y2
         b = b + 1
         blocks%vertices(:, 4*b - 3:4*b) = reshape([x1, y1, x2, y1, x2, y2, x1, y2], [2, 4])
      end subroutine add_rectangle

   end subroutine make_wall

   !> Room for nb rectangles of material 1; vertices are left to the caller.
   subroutine start_blocks(blocks, nb)
      type(block_system_type), intent(inout) :: blocks
      integer, intent(in) :: nb
      real(wp), allocatable :: none(:, :)
      integer, allocatable :: no_block(:)
      integer :: i
      allocate (none(2, 0), no_block(0))
      blocks%n_blocks = nb
      blocks%vertex_offset = [(4*i, i=0, nb)]
      blocks%edge_node_distance = 1.0e-3_wp
      allocate (blocks%vertices(2, 4*nb))
      allocate (blocks%edge_joint(4*nb), blocks%block_material(nb), source=1)
      call set_points(blocks%fixed, none, no_block)
      call set_points(blocks%loading, none, no_block)
      call set_points(blocks%measured, none, no_block)
      allocate (blocks%bolts%ends(4, 0), blocks%bolts%blocks(2, 0), blocks%bolts%stiffness(0), &
                blocks%bolts%pretension(0), blocks%bolts%strength(0))
   end subroutine start_blocks

   !> Fill a set of points.
   subroutine set_points(set, position, block)
      type(point_set_type), intent(inout) :: set
      real(wp), intent(in) :: position(:, :)   !! (2, n)
      integer, intent(in) :: block(:)          !! (n)
      set%n = size(block)
      set%position = position
      set%block = block
      if (allocated(set%origin)) deallocate (set%origin)
      allocate (set%origin(set%n))
   end subroutine set_points

   !> Layers in bond, half a metre thick, between two fixed abutments; two and a half times as long as thick.
   subroutine make_roof(n, blocks, error)
      integer, intent(in) :: n
      type(block_system_type), intent(out) :: blocks
      type(error_type), allocatable, intent(out) :: error
      type(drawing_type) :: drawing
      real(wp) :: half, top, x, side
      integer :: layers, columns, i, j, k
      layers = max(2, nint(sqrt(n/2.5_wp)))
      columns = max(2, nint(n/real(layers, wp)))
      half = 0.25_wp*columns
      top = 0.5_wp*layers
      do j = 0, layers
         call drawing%add([-half, 0.5_wp*j, half, 0.5_wp*j])
      end do
      do j = 0, layers - 1
         do i = 1, columns
            x = -half + 0.5_wp*i - merge(0.25_wp, 0.0_wp, mod(j, 2) == 1)
            if (x < half - 0.1_wp) call drawing%add([x, 0.5_wp*j, x, 0.5_wp*j + 0.5_wp])
         end do
      end do
      do k = -1, 1, 2
         side = k*(half + 2)
         call drawing%add([k*half, -1.0_wp, k*half, top + 1])
         call drawing%add([side, -1.0_wp, side, top + 1])
         call drawing%add([k*half, -1.0_wp, side, -1.0_wp])
         call drawing%add([k*half, top + 1, side, top + 1])
      end do
      call cut(drawing, reshape([-half, -1.0_wp, -half, top + 1, -half - 2, -1.0_wp, -half - 2, top + 1, &
                                 half, -1.0_wp, half, top + 1, half + 2, -1.0_wp, half + 2, top + 1], [2, 8]), &
               reshape([real(wp) ::], [2, 0]), blocks, error)
   end subroutine make_roof

   !> A horseshoe tunnel of 10 m x 10 m in a domain of 40 m x 50 m: bedding planes 1 m apart with randomness 0.25,
   !> vertical joints 1.5 m apart, 25 m long with bridges of 1 m; the outermost metre is a frame of four fixed blocks.
   subroutine make_tunnel(blocks, error)
      type(block_system_type), intent(out) :: blocks
      type(error_type), allocatable, intent(out) :: error
      real(wp), parameter :: width = 40, height = 50, trace = 25, bridge = 1, spacing = 1.5_wp, floor = 11
      integer, parameter :: n_arch = 16
      type(drawing_type) :: drawing
      type(random_type) :: random
      real(wp) :: opening(2, n_arch + 3), inside(4), outside(4), x, y, from, a
      integer :: i, k, n

      outside = [-0.5_wp*width, 0.0_wp, 0.5_wp*width, height]
      inside = outside + [1, 1, -1, -1]
      ! walls 5 m high, an arch of 5 m above
      opening(:, 1) = [-5.0_wp, floor]
      opening(:, 2) = [5.0_wp, floor]
      do i = 0, n_arch
         a = pi*i/n_arch
         opening(:, 3 + i) = [5*cos(a), floor + 5 + 5*sin(a)]
      end do
      n = size(opening, 2)
      do i = 1, n
         call drawing%add([opening(:, i), opening(:, mod(i, n) + 1)])
      end do
      call add_box(inside)
      call add_box(outside)
      ! the joints of the frame: floor and roof between walls of full height
      call drawing%add([inside(1), outside(2), inside(1), inside(2)])
      call drawing%add([inside(3), outside(2), inside(3), inside(2)])
      call drawing%add([inside(1), outside(4), inside(1), inside(4)])
      call drawing%add([inside(3), outside(4), inside(3), inside(4)])

      y = inside(2)
      do
         y = y + 1 + 2*0.25_wp*(random%next() - 0.5_wp)
         if (y > inside(4) - 0.3_wp) exit
         call drawing%add_inside([inside(1), y, inside(3), y], opening)
      end do
      k = 0
      x = inside(1)
      do
         k = k + 1
         x = x + spacing
         if (x > inside(3) - 0.3_wp) exit
         ! every other row is shifted by half of trace and bridge
         from = inside(2) - merge(0.5_wp*(trace + bridge), 0.0_wp, mod(k, 2) == 0)
         do while (from < inside(4))
            call drawing%add_inside([x, max(from, inside(2)), x, min(from + trace, inside(4))], opening)
            from = from + trace + bridge
         end do
      end do
      call cut(drawing, reshape([-19.9_wp, 0.1_wp, -19.9_wp, 25.0_wp, -19.9_wp, 49.9_wp, &
                                 19.9_wp, 0.1_wp, 19.9_wp, 25.0_wp, 19.9_wp, 49.9_wp, &
                                 -18.5_wp, 0.5_wp, 0.0_wp, 0.5_wp, 18.5_wp, 0.5_wp, &
                                 -18.5_wp, 49.5_wp, 0.0_wp, 49.5_wp, 18.5_wp, 49.5_wp], [2, 12]), &
               reshape([0.0_wp, floor + 2], [2, 1]), blocks, error)

   contains

      !> Append the sides of a rectangle.
      subroutine add_box(box)
         real(wp), intent(in) :: box(4)   !! x1 y1 x2 y2
         call drawing%add([box(1), box(2), box(3), box(2)])
         call drawing%add([box(3), box(2), box(3), box(4)])
         call drawing%add([box(3), box(4), box(1), box(4)])
         call drawing%add([box(1), box(4), box(1), box(2)])
      end subroutine add_box

   end subroutine make_tunnel

   !> A slope of 60 degrees in rock with two joint sets of random spacing, dipping 30 degrees out of the slope and
   !> 70 degrees into it, on one fixed block.
   subroutine make_slope(n, blocks, error)
      integer, intent(in) :: n
      type(block_system_type), intent(out) :: blocks
      type(error_type), allocatable, intent(out) :: error
      type(drawing_type) :: drawing
      type(random_type) :: random
      real(wp) :: rock(2, 4), height, toe, back, s, direction(2), across(2), x(2)
      real(wp), parameter :: dip(2) = [30.0_wp, 110.0_wp]
      integer :: set, i
      ! 4/5 of the area n is a joint mesh of 1 m x 1 m
      height = sqrt(0.62_wp*n)
      toe = height/tan(pi/3)
      back = 2*height
      rock = reshape([0.0_wp, 0.0_wp, back, 0.0_wp, back, height, toe, height], [2, 4])
      do i = 1, 4
         call drawing%add([rock(:, i), rock(:, mod(i, 4) + 1)])
      end do
      call drawing%add([0.0_wp, 0.0_wp, -2.0_wp, 0.0_wp])
      call drawing%add([-2.0_wp, 0.0_wp, -2.0_wp, -2.0_wp])
      call drawing%add([-2.0_wp, -2.0_wp, back + 2, -2.0_wp])
      call drawing%add([back + 2, -2.0_wp, back + 2, height])
      call drawing%add([back + 2, height, back, height])
      do set = 1, 2
         direction = [cos(pi*dip(set)/180), sin(pi*dip(set)/180)]
         across = [-direction(2), direction(1)]
         s = -3*back
         do while (s < 3*back)
            s = s + 0.6_wp + 0.8_wp*random%next()
            x = s*across
            call clip_and_add([x - 4*back*direction, x + 4*back*direction])
         end do
      end do
      call cut(drawing, reshape([-1.9_wp, -1.9_wp, back + 1.9_wp, -1.9_wp, back + 1.9_wp, height - 0.1_wp, &
                                 0.5_wp*back, -1.9_wp], [2, 4]), reshape([real(wp) ::], [2, 0]), blocks, error)

   contains

      !> The part of a line inside the (convex) rock.
      subroutine clip_and_add(line)
         real(wp), intent(in) :: line(4)
         real(wp) :: low, high
         call clip_convex(line, rock, low, high)
         if (high - low < 1.0e-9_wp) return
         call drawing%add([line(1:2) + low*(line(3:4) - line(1:2)), line(1:2) + high*(line(3:4) - line(1:2))])
      end subroutine clip_and_add

   end subroutine make_slope

   !> One block on an incline of 30 degrees.
   subroutine make_slide(blocks, error)
      type(block_system_type), intent(out) :: blocks
      type(error_type), allocatable, intent(out) :: error
      type(drawing_type) :: drawing
      real(wp) :: t(2), n(2), a(2)
      t = [cos(pi/6), sin(pi/6)]
      n = [-t(2), t(1)]
      a = 6*t
      call drawing%add([[0.0_wp, 0.0_wp], 10*t])
      call drawing%add([10*t, 10*t(1), 0.0_wp])
      call drawing%add([10*t(1), 0.0_wp, 0.0_wp, 0.0_wp])
      call drawing%add([a, a + n])
      call drawing%add([a + n, a + n + 2*t])
      call drawing%add([a + n + 2*t, a + 2*t])
      call cut(drawing, reshape([0.1_wp, 0.01_wp, 10*t(1) - 0.1_wp, 0.01_wp, 10*t(1) - 0.1_wp, 4.8_wp], [2, 3]), &
               reshape([real(wp) ::], [2, 0]), blocks, error)
   end subroutine make_slide

   !> Cut the lines of a drawing into blocks, with fixed points and holes.
   subroutine cut(drawing, fixed, holes, blocks, error)
      type(drawing_type), intent(in) :: drawing
      real(wp), intent(in) :: fixed(:, :), holes(:, :)   !! (2, n)
      type(block_system_type), intent(out) :: blocks
      type(error_type), allocatable, intent(out) :: error
      type(geometry_input_type) :: geometry
      type(diagnostics_type) :: messages
      type(cut_report_type) :: report
      call geometry%allocate_all(drawing%n, 0, 0, size(fixed, 2), 0, 0, size(holes, 2))
      geometry%edge_node_distance = 0.01_wp
      geometry%lines = drawing%lines(:, 1:drawing%n)
      geometry%fixed_lines(1:2, :) = fixed
      geometry%fixed_lines(3:4, :) = fixed
      geometry%hole_points = holes
      call cut_blocks(geometry, blocks, report, messages, error)
   end subroutine cut

   !> Append a line.
   subroutine add_line(self, line)
      class(drawing_type), intent(inout) :: self
      real(wp), intent(in) :: line(4)   !! x1 y1 x2 y2
      real(wp), allocatable :: more(:, :)
      if (.not. allocated(self%lines)) allocate (self%lines(4, 64))
      if (self%n == size(self%lines, 2)) then
         allocate (more(4, 2*self%n))
         more(:, 1:self%n) = self%lines
         call move_alloc(more, self%lines)
      end if
      self%n = self%n + 1
      self%lines(:, self%n) = line
   end subroutine add_line

   !> Append the parts of a line outside a convex opening.
   subroutine add_inside(self, line, opening)
      class(drawing_type), intent(inout) :: self
      real(wp), intent(in) :: line(4)         !! x1 y1 x2 y2
      real(wp), intent(in) :: opening(:, :)   !! (2, n) counter-clockwise
      real(wp) :: low, high, d(2)
      d = line(3:4) - line(1:2)
      call clip_convex(line, opening, low, high)
      if (high - low < 1.0e-9_wp) then
         call self%add(line)
         return
      end if
      if (low*norm2(d) > 0.1_wp) call self%add([line(1:2), line(1:2) + low*d])
      if ((1 - high)*norm2(d) > 0.1_wp) call self%add([line(1:2) + high*d, line(3:4)])
   end subroutine add_inside

   !> The parameters, from 0 to 1, between which a line is inside a convex polygon; high <= low when it is not.
   pure subroutine clip_convex(line, polygon, low, high)
      real(wp), intent(in) :: line(4)
      real(wp), intent(in) :: polygon(:, :)   !! (2, n) counter-clockwise
      real(wp), intent(out) :: low, high
      real(wp) :: e(2), d(2), speed, inside
      integer :: i, n
      low = 0
      high = 1
      d = line(3:4) - line(1:2)
      n = size(polygon, 2)
      do i = 1, n
         e = polygon(:, mod(i, n) + 1) - polygon(:, i)
         inside = e(1)*(line(2) - polygon(2, i)) - e(2)*(line(1) - polygon(1, i))
         speed = e(1)*d(2) - e(2)*d(1)
         if (abs(speed) <= 1.0e-12_wp*norm2(e)*norm2(d)) then
            if (inside <= 0) high = -1
         else if (speed > 0) then
            low = max(low, -inside/speed)
         else
            high = min(high, -inside/speed)
         end if
      end do
   end subroutine clip_convex

   !> Next number of a linear congruential generator (modulus 2^31 - 1, multiplier 48271).
   real(wp) function next(self)
      class(random_type), intent(inout) :: self
      self%state = mod(self%state*48271_i8, 2147483647_i8)
      next = real(self%state, wp)/2147483647.0_wp
   end function next

end module bench_models
