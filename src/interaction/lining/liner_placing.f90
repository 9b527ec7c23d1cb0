! SPDX-License-Identifier: MIT
!> Where linings are: drawn on their lines, installed on the deformed wall without stress, held to the rock or to the
!> lining below, and hardened.
module rockdda_interaction_liner_placing
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : is_given
   use rockdda_geometry_polygons, only : polygon_properties
   use rockdda_model_analysis_input, only : block_material_type
   use rockdda_model_bolt_layout, only : stage_with, rock_at
   use rockdda_model_liner_layout, only : new_liner_layout, line_of_liner, title_of_liner, lower_liner, lift, last_below
   use rockdda_model_options, only : is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : same_name, material_number
   use rockdda_interaction_joint_strength, only : joint_law_type
   use rockdda_interaction_context, only : step_context_type
   use rockdda_interaction_liner, only : liner_type, set_young, installed_centroids, on_segment, turned, acts, respond
   use rockdda_interaction_liner_beam, only : liner_section_type, beam_response_type, new_beam, respond_beam, &
      deformation_of
   use rockdda_interaction_liner_places, only : stretch_type, find_stretches, follow_rock, faces_of_path, &
      segment_outline, opening_side, reach_over_thickness, rock_ends, block_ends, distances_along
   use rockdda_interaction_liner_ties, only : tie_type, tie_response_type, tie_state
   implicit none
   private
   public :: add_liner_materials, draw_liner, append_segments, install_liner, join_segments, harden

   !> Stiffness of a bond over E'/thickness of the lining, least and most, and by the third power of thickness over
   !> distance of nodes: a segment of which a half is held does not turn, and its end is clamped.
   real(wp), parameter :: least_bond = 100, most_bond = 1000, bond_of_segment = 120
   !> The same of a joint without stiffness of its own: near that of joints of the rock. With the
   !> stiffness of a bond half of each segment lifts where it slides, and friction has no state in which it rests.
   real(wp), parameter :: loose = 0.3_wp
   !> Modulus of the strains of segments, over that of the lining: of forces that they take from the beams.
   real(wp), parameter :: soft = 1.0e-3_wp
   !> A block along more of a lining than this number of distances of nodes holds each segment at two points.
   real(wp), parameter :: long_block = 2.5_wp
   !> Stretches of a segment below this share of it are none.
   real(wp), parameter :: least_stretch = 1.0e-3_wp

contains

   !> Give each lining a block material for its segments, behind all others, unless they have them.
   pure subroutine add_liner_materials(parameters)
      type(parameters_type), intent(inout) :: parameters
      type(block_material_type) :: own
      integer :: k
      if (.not. allocated(parameters%liners)) return
      if (size(parameters%liners) == 0 .or. parameters%first_liner_material > 0) return
      parameters%first_liner_material = size(parameters%block_materials)
      do k = 1, size(parameters%liners)
         associate (liner => parameters%liners(k), first => parameters%block_materials(1))
            own = block_material_type(density=first%density, youngs_modulus=soft*liner%young)
            if (is_set(liner%density)) own%density = liner%density
            own%weight = own%density*parameters%acceleration_of_gravity()
            parameters%block_materials = [parameters%block_materials, own]
         end associate
      end do
   end subroutine add_liner_materials

   !> Poisson's ratio, or that which a lining has by default.
   pure real(wp) function poisson_of(given)
      real(wp), intent(in) :: given
      poisson_of = 0.2_wp
      if (is_set(given)) poisson_of = given
   end function poisson_of

   !> Lining k of a model, on its line as drawn, behind those before it. The context holds the blocks of the
   !> model alone.
   subroutine draw_liner(context, k, before, liners)
      type(step_context_type), intent(in) :: context
      integer, intent(in) :: k
      integer, intent(in) :: before                  !! block before its first segment
      type(liner_type), intent(inout) :: liners(:)   !! those before it are drawn
      real(wp), allocatable :: line(:)
      associate (p => context%parameters, liner => liners(k), given => context%parameters%liners(k))
         liner%name = title_of_liner(given, k)
         liner%installs = stage_with(p%stages, liner%name, installs=.true.)
         liner%removes = stage_with(p%stages, liner%name, installs=.false.)
         liner%lower = lower_liner(p%liners, k)
         liner%poisson = poisson_of(given%poisson)
         liner%section%thickness = given%thickness
         liner%section%shear = 0.5_wp*(1 - liner%poisson)
         if (is_set(given%compressive_strength)) liner%section%compression = given%compressive_strength
         if (is_set(given%tensile_strength)) liner%section%tension = given%tensile_strength
         if (liner%lower > 0) then
            liner%layout = liners(liner%lower)%layout
            liner%lift = 0.5_wp*(liners(liner%lower)%section%thickness + given%thickness)
         else
            line = line_of_liner(p%liners, k, context%blocks, p%regions)
            liner%layout = new_liner_layout(line, given%thickness, given%element)
            call break_at_rock(context, line, given%element, liner)
         end if
         call set_back(p, given%joint_material, liner)
         call set_young(given%young, liner)
         liner%before = before
         if (liner%lower > 0) liner%side = liners(liner%lower)%side
         allocate (liner%joints(0), liner%ties(0))
         if (liner%layout%n == 0) return
         liner%path = liner%layout%path
         if (liner%lower > 0) liner%path = lift(liner%path, liner%layout%closed, liner%side*liner%lift)
      end associate
   end subroutine draw_liner

   !> Put nodes where the rock along a line begins or ends, when the lining is installed or once a later stage has
   !> excavated or placed blocks: the largest moment of a lining over a gap is that at the end of the rock.
   pure subroutine break_at_rock(context, line, element, liner)
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: line(:), element
      type(liner_type), intent(inout) :: liner
      type(stretch_type), allocatable :: stretches(:)
      real(wp), allocatable :: ends(:), seams(:)
      logical :: rock(context%blocks%n_blocks), before(context%blocks%n_blocks)
      integer :: side, stage
      if (liner%layout%n == 0) return
      allocate (ends(0), seams(0))
      associate (p => context%parameters, blocks => context%blocks, layout => liner%layout, &
                 t => liner%section%thickness)
         do stage = liner%installs, max(liner%installs, size(p%stages))
            rock = rock_at(blocks, p%regions, p%stages, stage)
            if (stage > liner%installs) then
               if (all(rock .eqv. before)) cycle
            end if
            before = rock
            call find_stretches(layout%path, reach_over_thickness*t, blocks, blocks%vertices, rock, stretches, side)
            if (stage == liner%installs) then
               liner%side = merge(side, opening_side(layout%path, layout%closed), side /= 0)
               if (size(stretches) == 0) return
               seams = layout%start + block_ends(layout%path, stretches, 0.1_wp*t)
            end if
            ends = [ends, layout%start + rock_ends(layout%path, stretches, 0.1_wp*t)]
         end do
      end associate
      liner%layout = new_liner_layout(line, liner%section%thickness, element, ends, seams)
   end subroutine break_at_rock

   !> Stiffness of the back, by the modulus or that of its joint material, and that material.
   pure subroutine set_back(parameters, word, liner)
      type(parameters_type), intent(in) :: parameters
      character(len=:), allocatable, intent(in) :: word
      type(liner_type), intent(inout) :: liner
      integer :: i
      liner%bond = max(least_bond, min(most_bond, bond_of_segment*(liner%section%thickness/mean_distance())**3))/ &
                   liner%section%thickness
      liner%joint = 0
      if (.not. is_given(word)) return
      i = material_number(trim(adjustl(word)))
      if (i >= 1 .and. i <= size(parameters%joint_materials)) liner%joint = i
      do i = 1, size(parameters%joint_materials)
         if (.not. is_given(parameters%joint_materials(i)%name)) cycle
         if (same_name(parameters%joint_materials(i)%name, word)) liner%joint = i
      end do
      if (liner%joint == 0) return
      associate (joint => parameters%joint_materials(liner%joint))
         liner%bond = loose/liner%section%thickness
         if (joint%normal_stiffness > 0) liner%stiffness = joint%normal_stiffness
         if (joint%shear_stiffness > 0) liner%stiffness(2) = joint%shear_stiffness
      end associate
      where (liner%stiffness > 0) liner%bond = 0

   contains

      !> Mean distance of the nodes.
      pure real(wp) function mean_distance()
         integer :: k
         mean_distance = liner%section%thickness
         if (liner%layout%n < 2) return
         mean_distance = sum([(norm2(liner%layout%path(:, k + 1) - liner%layout%path(:, k)), &
                               k=1, size(liner%layout%path, 2) - 1)])/merge(liner%layout%n, &
                        liner%layout%n - 1, liner%layout%closed)
      end function mean_distance

   end subroutine set_back

   !> Append the segments of all linings, absent, to blocks and state.
   subroutine append_segments(liners, context)
      type(liner_type), intent(in) :: liners(:)
      type(step_context_type), intent(inout) :: context
      integer :: b, i, k, n, at
      if (size(liners) == 0) return
      n = sum([(liners(k)%layout%n, k=1, size(liners))])
      at = 0
      do k = 1, size(liners)
         do i = 1, liners(k)%layout%n
            at = at + 2*(liners(k)%layout%last(i) - liners(k)%layout%first(i) + 1)
         end do
      end do
      associate (blocks => context%blocks)
         b = blocks%n_blocks
         blocks%vertices = columns(blocks%vertices, zeros(2, at))
         at = blocks%vertex_offset(b + 1)
         blocks%edge_joint = [blocks%edge_joint, spread(0, 1, size(blocks%vertices, 2) - at)]
         blocks%vertex_offset = [blocks%vertex_offset, spread(0, 1, n)]
         blocks%block_material = [blocks%block_material, spread(0, 1, n)]
         if (allocated(blocks%file_line)) blocks%file_line = [blocks%file_line, spread(0, 1, n)]
         if (allocated(blocks%parent)) blocks%parent = [blocks%parent, (i, i=b + 1, b + n)]
         blocks%n_blocks = b + n
         do k = 1, size(liners)
            associate (liner => liners(k), layout => liners(k)%layout)
               if (layout%n == 0) cycle
               associate (faces => faces_of_path(liner%path, layout%closed, liner%side, liner%section%thickness))
                  do i = 1, layout%n
                     b = b + 1
                     associate (outline => segment_outline(faces, layout%first(i), layout%last(i), liner%side))
                        blocks%vertices(:, at + 1:at + size(outline, 2)) = outline
                        at = at + size(outline, 2)
                     end associate
                     blocks%vertex_offset(b + 1) = at
                     blocks%block_material(b) = context%parameters%first_liner_material + k
                  end do
               end associate
            end associate
         end do
      end associate
      associate (blocks => context%blocks, state => context%state)
         blocks%n_segments = n
         state%vertices = blocks%vertices
         state%centroid = columns(state%centroid, zeros(2, n))
         state%rotation = [state%rotation, spread(0.0_wp, 1, n)]
         state%stress = columns(state%stress, zeros(3, n))
         state%velocity = columns(state%velocity, zeros(6, n))
         state%acceleration = columns(state%acceleration, zeros(6, n))
         state%area = [state%area, spread(0.0_wp, 1, n)]
         state%moments = columns(state%moments, zeros(3, n))
         state%mass = [state%mass, spread(0.0_wp, 1, n)]
         state%active = [state%active, spread(.false., 1, n)]
         state%asleep = [state%asleep, spread(.false., 1, n)]
         state%calm = [state%calm, spread(0, 1, n)]
         if (allocated(context%held)) context%held = [context%held, spread(.false., 1, n)]
         ! blocks beside a lining do not sleep
         if (allocated(context%bolted)) deallocate (context%bolted)
         allocate (context%bolted(blocks%n_blocks), source=.true.)
         do i = blocks%n_blocks - n + 1, blocks%n_blocks
            call set_properties(context, i)
         end do
         associate (field => context%initial_stress)
            if (allocated(field%stress)) then
               field%stress = columns(field%stress, zeros(3, n))
               field%gradient = reshape([field%gradient, zeros(6, n)], [3, 2, blocks%n_blocks])
               field%centroid = state%centroid
            end if
         end associate
      end associate
   end subroutine append_segments

   !> Two tables side by side.
   pure function columns(a, b) result(both)
      real(wp), intent(in) :: a(:, :), b(:, :)
      real(wp) :: both(size(a, 1), size(a, 2) + size(b, 2))
      both(:, :size(a, 2)) = a
      both(:, size(a, 2) + 1:) = b
   end function columns

   !> A table of zeros.
   pure function zeros(m, n)
      integer, intent(in) :: m, n
      real(wp) :: zeros(m, n)
      zeros = 0
   end function zeros

   !> Area, centroid, moments and mass of a segment, by its outline.
   subroutine set_properties(context, i)
      type(step_context_type), intent(inout) :: context
      integer, intent(in) :: i       !! block
      associate (state => context%state, blocks => context%blocks)
         call polygon_properties(state%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)), &
                                 state%area(i), state%centroid(:, i), state%moments(:, i))
         state%mass(i) = context%parameters%block_materials(blocks%block_material(i))%density*state%area(i)
      end associate
   end subroutine set_properties

   !> Install a lining on the deformed outline, free of stress.
   subroutine install_liner(liners, k, context)
      type(liner_type), intent(inout) :: liners(:)
      integer, intent(in) :: k
      type(step_context_type), intent(inout) :: context
      type(stretch_type), allocatable :: stretches(:)
      real(wp), allocatable :: faces(:, :, :)
      real(wp) :: reach
      integer :: b, i, side
      associate (liner => liners(k), layout => liners(k)%layout, state => context%state)
         if (layout%n == 0) return
         if (liner%lower > 0) then
            if (.not. liners(liner%lower)%is_there) return
            liner%side = liners(liner%lower)%side
            liner%path = lift(path_now(context, liners(liner%lower)), layout%closed, liner%side*liner%lift)
            allocate (stretches(0))
         else
            reach = reach_over_thickness*liner%section%thickness
            liner%path = follow_rock(layout%path, reach, context%blocks, state%vertices, state%active)
            if (layout%closed) liner%path(:, size(liner%path, 2)) = liner%path(:, 1)
            call find_stretches(liner%path, reach, context%blocks, state%vertices, state%active, stretches, side)
            liner%side = opening_side(liner%path, layout%closed)
            if (side /= 0) liner%side = side
         end if
         liner%is_there = .true.
         faces = faces_of_path(liner%path, layout%closed, liner%side, liner%section%thickness)
         do i = 1, layout%n
            b = liner%before + i
            state%vertices(:, context%blocks%vertex_offset(b) + 1:context%blocks%vertex_offset(b + 1)) = &
               segment_outline(faces, layout%first(i), layout%last(i), liner%side)
            call set_properties(context, b)
            state%rotation(b) = 0
            state%velocity(:, b) = 0
            state%acceleration(:, b) = 0
            state%stress(:, b) = 0
            state%active(b) = .true.
         end do
         if (liner%lower > 0) then
            call tie_to_lining(context, liners(liner%lower), liner)
         else
            call tie_to_rock(context, stretches, liner)
         end if
         call join_segments(liner)
      end associate
   end subroutine install_liner

   !> Where the path of a lining that is there lies now, by its segments; at the end of two of them half-way between.
   pure function path_now(context, liner) result(path)
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: liner
      real(wp), allocatable :: path(:, :), center(:, :)
      integer :: i, n(size(liner%path, 2)), p
      allocate (path, mold=liner%path)
      path = 0
      n = 0
      center = installed_centroids(liner)
      do i = 1, liner%layout%n
         do p = liner%layout%first(i), liner%layout%last(i)
            path(:, p) = path(:, p) + on_segment(context, liner%before + i, liner%path(:, p) - center(:, i))
            n(p) = n(p) + 1
         end do
      end do
      path = path/spread(n, 1, 2)
      if (.not. liner%layout%closed) return
      p = size(path, 2)
      path(:, 1) = 0.5_wp*(path(:, 1) + path(:, p))
      path(:, p) = path(:, 1)
   end function path_now

   !> Beams between all neighbours, on the path as installed, when the ties are known.
   pure subroutine join_segments(liner)
      type(liner_type), intent(inout) :: liner
      real(wp) :: center(2, liner%layout%n)
      real(wp), allocatable :: path(:, :)
      integer :: i, next, n
      if (allocated(liner%joints)) deallocate (liner%joints)
      n = liner%layout%n
      allocate (liner%joints(merge(n, n - 1, liner%layout%closed)))
      center = installed_centroids(liner)
      do i = 1, size(liner%joints)
         next = 1 + mod(i, n)
         if (next > i) then
            path = liner%path(:, liner%layout%node(i):liner%layout%node(next))
         else
            path = columns(liner%path(:, liner%layout%node(i):), liner%path(:, 2:liner%layout%node(1)))
         end if
         associate (joint => liner%joints(i))
            joint%block = liner%before + [i, next]
            joint%beam = new_beam(path, liner%section, liner%side, &
                                  any(liner%ties%b == joint%block(1)) .and. any(liner%ties%b == joint%block(2)))
            joint%arm(:, 1) = joint%beam%center - center(:, i)
            joint%arm(:, 2) = joint%beam%center - center(:, next)
         end associate
      end do
   end subroutine join_segments

   !> Hold the back to the rock: in the middle of the part of a segment along each block; along a block far longer than
   !> segments, or without another one beside it, at two points. The back may strain between its node and the points,
   !> take its own slope beside two small blocks, and bend beside three: a surface of small blocks has steps, which are
   !> no rotation of the lining.
   subroutine tie_to_rock(context, stretches, liner)
      type(step_context_type), intent(in) :: context
      type(stretch_type), intent(in) :: stretches(:)
      type(liner_type), intent(inout) :: liner
      type(tie_type) :: tie
      real(wp) :: s(size(liner%path, 2)), ends(2, size(stretches)), whole(size(stretches)), along(2), normal(2)
      real(wp) :: from, to, at, half, node, usual
      integer :: g, i, j, n, n_ties, of(size(stretches)), block(size(stretches)), piece(size(liner%path, 2))
      integer :: parts(0:liner%layout%n), first(liner%layout%n + 1)
      logical :: alone
      if (allocated(liner%ties)) deallocate (liner%ties)
      allocate (liner%ties(2*size(stretches)))
      n_ties = 0
      do i = 1, liner%layout%n
         piece(liner%layout%first(i):liner%layout%last(i) - 1) = i
      end do
      s = distances_along(liner%path)
      usual = s(size(s))/merge(liner%layout%n, liner%layout%n - 1, liner%layout%closed)
      ! one part for each block and segment
      n = 0
      do j = 1, size(stretches)
         associate (k => stretches(j)%piece)
            from = s(k) + stretches(j)%ends(1)*(s(k + 1) - s(k))
            to = s(k) + stretches(j)%ends(2)*(s(k + 1) - s(k))
            i = piece(k)
         end associate
         if (n > 0) then
            if (block(n) == stretches(j)%block .and. of(n) == i .and. from - ends(2, n) < least_stretch*usual) then
               ends(2, n) = to
               cycle
            end if
         end if
         n = n + 1
         ends(:, n) = [from, to]
         block(n) = stretches(j)%block
         of(n) = i
      end do
      do j = 1, n
         whole(j) = ends(2, j) - ends(1, j)
         if (j == 1) cycle
         if (block(j) == block(j - 1) .and. ends(1, j) - ends(2, j - 1) < least_stretch*usual) &
            whole(j) = whole(j) + whole(j - 1)
      end do
      do j = n - 1, 1, -1
         if (block(j) == block(j + 1) .and. ends(1, j + 1) - ends(2, j) < least_stretch*usual) whole(j) = whole(j + 1)
      end do
      where (ends(2, :n) - ends(1, :n) < least_stretch*usual) of(:n) = 0
      parts = 0
      do j = 1, n
         parts(of(j)) = parts(of(j)) + 1
      end do
      do j = 1, n
         if (of(j) == 0) cycle
         half = 0.5_wp*(ends(2, j) - ends(1, j))
         node = s(liner%layout%node(of(j)))
         along = point_at(ends(2, j)) - point_at(ends(1, j))
         normal = liner%side*[-along(2), along(1)]
         tie%a = block(j)
         tie%b = liner%before + of(j)
         tie%angle = atan2(normal(2), normal(1))
         alone = whole(j) > long_block*usual .or. .not. has_neighbour(j)
         tie%length = merge(half, 2*half, alone)
         do g = merge(-1, 1, alone), 1, 2
            at = 0.5_wp*sum(ends(:, j)) + merge(g*half/sqrt(3.0_wp), 0.0_wp, alone)
            tie%at_a = point_at(at)
            tie%arm = tie%at_a - context%state%centroid(:, tie%b)
            tie%shape = [(at - node)**2/liner%section%thickness, -liner%side*(at - node), at - node]
            if (alone) then
               tie%shape([1, 3]) = 0
            else
               if (parts(of(j)) < 3) tie%shape(1) = 0
               if (parts(of(j)) < 2) tie%shape = 0
            end if
            n_ties = n_ties + 1
            liner%ties(n_ties) = tie
         end do
      end do
      liner%ties = liner%ties(:n_ties)
      ! ties of a segment follow each other
      first = 0
      do j = 1, n_ties
         i = liner%ties(j)%b - liner%before
         if (first(i) == 0) first(i) = j
      end do
      first(liner%layout%n + 1) = n_ties + 1
      do i = liner%layout%n, 1, -1
         if (first(i) == 0) first(i) = first(i + 1)
         call center_shapes([(j, j=first(i), first(i + 1) - 1)])
      end do

   contains

      !> The shapes of a back have no mean: uniform pressure and shear do not change it.
      subroutine center_shapes(mine)
         integer, intent(in) :: mine(:)
         logical :: has(size(mine))
         integer :: k
         associate (ties => liner%ties)
            do k = 1, 3
               has = abs(ties(mine)%shape(k)) > 0
               if (.not. any(has)) cycle
               where (has) ties(mine)%shape(k) = ties(mine)%shape(k) - sum(ties(mine)%shape(k)*ties(mine)%length, &
                                                                          has)/sum(ties(mine)%length, has)
            end do
         end associate
      end subroutine center_shapes

      !> Does another block lie along the lining beside this one?
      pure logical function has_neighbour(j)
         integer, intent(in) :: j
         integer :: i
         has_neighbour = .false.
         do i = j + 1, n
            if (ends(1, i) - ends(2, j) >= 0.1_wp*usual .or. has_neighbour) exit
            has_neighbour = block(i) /= block(j)
         end do
         do i = j - 1, 1, -1
            if (ends(1, j) - ends(2, i) >= 0.1_wp*usual .or. has_neighbour) exit
            has_neighbour = block(i) /= block(j)
         end do
      end function has_neighbour

      !> Point of the path at a distance from its start.
      pure function point_at(distance) result(x)
         real(wp), intent(in) :: distance
         real(wp) :: x(2), share
         integer :: k
         k = max(1, min(size(s) - 1, last_below(distance, s)))
         share = max(0.0_wp, min(1.0_wp, (distance - s(k))/max(s(k + 1) - s(k), tiny(1.0_wp))))
         x = liner%path(:, k) + share*(liner%path(:, k + 1) - liner%path(:, k))
      end function point_at

   end subroutine tie_to_rock

   !> Hold a layer to the segments below, at their common face.
   subroutine tie_to_lining(context, lower, liner)
      type(step_context_type), intent(in) :: context
      type(liner_type), intent(in) :: lower
      type(liner_type), intent(inout) :: liner
      type(tie_type) :: tie
      real(wp) :: face(2, size(liner%path, 2)), along(2), x(2), normal(2)
      integer :: g, i, n, p
      if (allocated(liner%ties)) deallocate (liner%ties)
      allocate (liner%ties(2*size(face, 2)))
      n = 0
      face = lift(liner%path, liner%layout%closed, -0.5_wp*liner%side*liner%section%thickness)
      tie%on_rock = .false.
      do i = 1, liner%layout%n
         do p = liner%layout%first(i), liner%layout%last(i) - 1
            along = face(:, p + 1) - face(:, p)
            if (.not. norm2(along) > 0) cycle
            normal = liner%side*[-along(2), along(1)]/norm2(along)
            do g = -1, 1, 2
               x = face(:, p) + 0.5_wp*(1 + g/sqrt(3.0_wp))*along
               tie%a = lower%before + i
               tie%b = liner%before + i
               tie%at_a = turned(x - context%state%centroid(:, tie%a), -context%state%rotation(tie%a))
               tie%arm = x - context%state%centroid(:, tie%b)
               tie%angle = atan2(normal(2), normal(1))
               tie%length = 0.5_wp*norm2(along)
               n = n + 1
               liner%ties(n) = tie
            end do
         end do
      end do
      liner%ties = liner%ties(:n)
   end subroutine tie_to_lining

   !> A new Young's modulus under which all forces stay.
   subroutine harden(laws, context, young, liner)
      type(joint_law_type), allocatable, intent(in) :: laws(:)   !! of the joint materials
      type(step_context_type), intent(in) :: context
      real(wp), intent(in) :: young
      type(liner_type), intent(inout) :: liner
      type(beam_response_type) :: response
      type(tie_response_type) :: of_tie(size(liner%ties))
      type(liner_section_type) :: old
      integer :: i
      old = liner%section
      do i = 1, size(liner%ties)
         call respond(laws, liner, liner%ties(i), liner%ties(i)%motion, of_tie(i))
      end do
      call set_young(young, liner)
      if (.not. liner%is_there) return
      do i = 1, size(liner%ties)
         associate (tie => liner%ties(i), k => liner%stiffness*liner%ties(i)%length, of => of_tie(i))
            if (.not. acts(context, tie)) cycle
            if (of%state == tie_state%held .or. of%state == tie_state%slides) &
               tie%free(1) = tie%motion(1) - of%force(1)/k(1)
            tie%free(2) = tie%motion(2) - of%force(2)/k(2)
         end associate
      end do
      do i = 1, size(liner%joints)
         associate (joint => liner%joints(i))
            call respond_beam(joint%beam, old, joint%state, joint%d, response)
            joint%state%free = joint%d - deformation_of(joint%beam, liner%section, joint%state, response%f)
         end associate
      end do
   end subroutine harden

end module rockdda_interaction_liner_placing
