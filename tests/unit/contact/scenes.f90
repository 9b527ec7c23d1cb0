! SPDX-License-Identifier: MIT
!> Blocks, their neighbourhood and their outlines for tests of contact.
module scenes
   use rockdda_base_kinds, only : wp
   use rockdda_model_blocks, only : block_system_type
   use rockdda_contact_normal_law, only : linear_law
   use rockdda_contact_interval_law, only : n_points, closed_part_type, find_closed_part, part_forces
   use rockdda_contact_intervals, only : interval_type, place_points
   use rockdda_contact_outlines, only : outlines_type
   use rockdda_contact_search, only : contact_search_type
   use rockdda_contact_search_limits, only : search_limits_type
   use rockdda_contact_table, only : contact_table_type, is_of_interval
   use rockdda_contact_topology, only : contact_topology_type, new_contact_topology
   implicit none
   private
   public :: scene_type, point_type, new_scene, point_of, box, pair, turned, find_row, close_rows, load_springs, &
      energies, goes_on

   !> Angle tolerance of all scenes [rad].
   real(wp), parameter, public :: angle_tolerance = 0.05_wp
   !> Steps of a surface up to this count as plane.
   real(wp), parameter, public :: smooth = 1.0e-3_wp

   !> Stiffness per length of the springs of `close_rows`.
   real(wp), parameter, public :: k_n = 1000, k_s = 400

   type :: scene_type
      type(block_system_type) :: blocks
      type(contact_topology_type) :: topology
      type(outlines_type) :: outlines
      real(wp), allocatable :: vertices(:, :)   !! (2, nv) now
   contains
      procedure :: place
      procedure :: search
   end type scene_type

   !> One point of an interval.
   type :: point_type
      real(wp) :: place(2), share, normal(2), gap, length
   end type point_type

contains

   !> Point k of an interval.
   type(point_type) function point_of(interval, k, scene) result(point)
      type(interval_type), intent(in) :: interval
      integer, intent(in) :: k
      type(scene_type), intent(in) :: scene
      real(wp) :: place(2, n_points), share(n_points), normal(2, n_points), gap(n_points), length(n_points)
      call place_points(interval, size(scene%vertices, 2), scene%vertices, scene%outlines%tangent, place, share, &
         normal, &
                        gap, length)
      point = point_type(place(:, k), share(k), normal(:, k), gap(k), length(k))
   end function point_of

   !> A scene from polygons, one after the other, and the number of vertices of each.
   subroutine new_scene(sizes, vertices, scene)
      integer, intent(in) :: sizes(:)
      real(wp), intent(in) :: vertices(:, :)
      type(scene_type), intent(out) :: scene
      integer :: i
      associate (blocks => scene%blocks)
         blocks%n_blocks = size(sizes)
         blocks%vertex_offset = [0, (sum(sizes(1:i)), i=1, size(sizes))]
         blocks%vertices = vertices
         allocate (blocks%edge_joint(size(vertices, 2)), blocks%block_material(size(sizes)), source=1)
         call new_contact_topology(blocks, scene%topology)
      end associate
      call scene%place(vertices)
   end subroutine new_scene

   !> Put the vertices elsewhere.
   subroutine place(self, vertices)
      class(scene_type), intent(inout) :: self
      real(wp), intent(in) :: vertices(:, :)
      self%vertices = vertices
      call self%outlines%update(self%topology, self%vertices, sin(angle_tolerance))
   end subroutine place

   !> Contacts by length where the blocks are now, after those of the last step.
   subroutine search(self, previous, table)
      class(scene_type), intent(inout) :: self
      type(contact_table_type), intent(in), optional :: previous
      type(contact_table_type), intent(out) :: table
      type(contact_table_type) :: none
      type(contact_search_type) :: tool
      type(search_limits_type) :: limits
      limits%reach = 0.05_wp
      limits%zone = 0.025_wp
      limits%penetration = 0.05_wp
      limits%sine = sin(angle_tolerance)
      limits%cosine = cos(angle_tolerance)
      limits%by_length = .true.
      limits%is_tied = [.false.]
      limits%weakens = [.true.]
      limits%smooth = smooth
      if (present(previous)) then
         call tool%run(self%blocks, self%topology, self%vertices, limits, previous, .false., 1.0e-9_wp, table)
      else
         call none%resize(0)
         call tool%run(self%blocks, self%topology, self%vertices, limits, none, .false., 1.0e-9_wp, table)
      end if
   end subroutine search

   !> Rectangle, counter-clockwise from its lower left corner.
   pure function box(x0, y0, x1, y1) result(v)
      real(wp), intent(in) :: x0, y0, x1, y1
      real(wp) :: v(2, 4)
      v = reshape([x0, y0, x1, y0, x1, y1, x0, y1], [2, 4])
   end function box

   !> Vertices of two polygons, one after the other.
   pure function pair(first, second) result(v)
      real(wp), intent(in) :: first(:, :), second(:, :)
      real(wp) :: v(2, size(first, 2) + size(second, 2))
      v(:, 1:size(first, 2)) = first
      v(:, size(first, 2) + 1:) = second
   end function pair

   !> Points turned about a centre.
   pure function turned(points, angle, centre) result(v)
      real(wp), intent(in) :: points(:, :), angle, centre(2)
      real(wp) :: v(2, size(points, 2))
      v(1, :) = centre(1) + cos(angle)*(points(1, :) - centre(1)) - sin(angle)*(points(2, :) - centre(2))
      v(2, :) = centre(2) + sin(angle)*(points(1, :) - centre(1)) + cos(angle)*(points(2, :) - centre(2))
   end function turned

   !> Row of a table by its identity, 0 none.
   pure integer function find_row(table, vertex, edge, station) result(row)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: vertex, edge, station
      do row = 1, table%n
         if (table%vertex(row) == vertex .and. table%edge(row) == edge .and. table%station(row) == station) return
      end do
      row = 0
   end function find_row

   !> All rows as if closed in the last step, with the forces of their gaps; each row has a slip and a shear of its own.
   subroutine close_rows(table, state)
      type(contact_table_type), intent(inout) :: table
      integer, intent(in) :: state
      integer :: k
      do k = 1, table%n
         table%state(k) = state
         table%k_n(k) = k_n*table%length(k)
         table%k_s(k) = k_s*table%length(k)
         table%shear(k) = 0.001_wp*k
         table%total_slip(k) = 0.1_wp*k
         table%slip_sign(k) = 1
         table%bonded(k) = .false.
         table%bond_end(k) = 0
      end do
      call load_springs(table)
   end subroutine close_rows

   !> Forces and energies of all rows by their gaps and shears.
   subroutine load_springs(table)
      type(contact_table_type), intent(inout) :: table
      type(closed_part_type) :: part
      integer :: k
      do k = 1, table%n
         if (.not. is_of_interval(table, k)) then
            table%normal_force(k) = -table%k_n(k)*table%gap(k)
         else if (table%station(k) == 1) then
            call find_closed_part(table%gap(k:k + 1), [0.0_wp, 0.0_wp], linear_law, part)
            table%normal_force(k:k + 1) = part_forces(part, sum(table%k_n(k:k + 1)), table%gap(k:k + 1))
         end if
      end do
      do k = 1, table%n
         table%shear_force(k) = -table%k_s(k)*table%shear(k)
         table%energy(k) = 0.5_wp*(table%k_s(k)*table%shear(k)**2 - table%normal_force(k)*table%gap(k))
      end do
   end subroutine load_springs

   !> Energy of the normal (1) and shear springs (2) of some rows with the stiffness of their lengths.
   function energies(table, rows)
      type(contact_table_type), intent(in) :: table
      integer, intent(in) :: rows(:)
      real(wp) :: energies(2)
      type(contact_table_type) :: copy
      copy = table
      copy%k_n(1:copy%n) = k_n*copy%length(1:copy%n)
      copy%k_s(1:copy%n) = k_s*copy%length(1:copy%n)
      call load_springs(copy)
      energies(2) = 0.5_wp*sum(copy%k_s(rows)*copy%shear(rows)**2)
      energies(1) = sum(copy%energy(rows)) - energies(2)
   end function energies

   !> Is a row what another was: state, shear spring, slip and bond?
   logical function goes_on(table, row, previous, old)
      type(contact_table_type), intent(in) :: table, previous
      integer, intent(in) :: row, old
      goes_on = table%state(row) == previous%state(old) .and. table%slip_sign(row) == previous%slip_sign(old) .and. &
                abs(table%shear(row) - previous%shear(old)) <= 0 .and. &
                abs(table%total_slip(row) - previous%total_slip(old)) <= 0 .and. &
                (table%bonded(row) .eqv. previous%bonded(old))
   end function goes_on

end module scenes
