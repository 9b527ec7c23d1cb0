! SPDX-License-Identifier: MIT
!> Stress in the blocks at the start: of their materials, or of &in_situ.
!>
!> In a block the stress is linear: that of its centroid, which is the mean over the block and what the block carries,
!> and a gradient, by which the tractions on its edges balance its weight exactly.
!>
!>     under a surface      s22 = -(surcharge + weight above),   s11 = k0 s22,   s12 = 0
!>     given                s = stress + gradient*y
!>
!> The weight above is that of the blocks on the vertical line through the centroid; where there is no block, up to the
!> surface, that of the next block below. A block has stress when more than half of its area lies below the surface.
module rockdda_model_in_situ
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_base_strings, only : counted, to_string
   use rockdda_geometry_common_area, only : shape_type, set_polygon, common_area
   use rockdda_geometry_polygons, only : polygon_area, polygon_properties
   use rockdda_model_blocks, only : block_system_type
   use rockdda_model_options, only : in_situ_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : blocks_of_region
   implicit none
   private
   public :: initial_stress_type, find_initial_stress, check_in_situ, check_in_situ_blocks

   type :: initial_stress_type
      real(wp), allocatable :: stress(:, :)        !! (3, nb) sx sy txy at the centroid, tension positive
      real(wp), allocatable :: gradient(:, :, :)   !! (3, 2, nb) its change with x and with y
      real(wp), allocatable :: centroid(:, :)      !! (2, nb)
   contains
      procedure :: at => stress_at
   end type initial_stress_type

   !> The blocks by columns, to find those on a vertical line.
   type :: columns_type
      real(wp) :: left = 0, width = 1
      integer, allocatable :: start(:), items(:)   !! blocks of column c: items(start(c)+1:start(c+1))
      real(wp), allocatable :: boxes(:, :)         !! (4, nb)
      real(wp), allocatable :: unit_weight(:)      !! (nb)
      logical :: is_uniform = .true.               !! all unit weights are equal
   end type columns_type

contains

   !> Stress of all blocks at the start. Groups of &in_situ have been checked.
   pure subroutine find_initial_stress(blocks, parameters, field)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(initial_stress_type), intent(out) :: field
      type(columns_type) :: columns
      logical, allocatable :: inside(:)
      real(wp) :: area, moments(3)
      integer :: i, g
      allocate (field%stress(3, blocks%n_blocks), field%gradient(3, 2, blocks%n_blocks), &
                field%centroid(2, blocks%n_blocks))
      field%gradient = 0
      do i = 1, blocks%n_blocks
         call polygon_properties(blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)), area, &
                                 field%centroid(:, i), moments)
         associate (m => parameters%block_materials(blocks%block_material(i)))
            field%stress(:, i) = m%stress + m%stress_gradient*field%centroid(2, i)
            field%gradient(:, 2, i) = m%stress_gradient
         end associate
      end do
      if (.not. allocated(parameters%in_situ)) return
      do g = 1, size(parameters%in_situ)
         inside = blocks_of_group(blocks, parameters, parameters%in_situ(g))
         associate (group => parameters%in_situ(g))
            if (allocated(group%stress)) then
               do i = 1, blocks%n_blocks
                  if (inside(i)) call take_given(group, field%centroid(:, i), field%stress(:, i), &
                                                  field%gradient(:, :, i))
               end do
            else
               if (.not. allocated(columns%start)) call sort_into_columns(blocks, parameters, columns)
               do i = 1, blocks%n_blocks
                  if (inside(i)) call take_weight(blocks, columns, group, i, field%centroid(:, i), &
                                                  field%stress(:, i), field%gradient(:, :, i))
               end do
            end if
         end associate
      end do
   end subroutine find_initial_stress

   !> Stress at a point of block i.
   pure function stress_at(self, i, point) result(stress)
      class(initial_stress_type), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: point(2)
      real(wp) :: stress(3)
      stress = self%stress(:, i) + self%gradient(:, 1, i)*(point(1) - self%centroid(1, i)) + &
               self%gradient(:, 2, i)*(point(2) - self%centroid(2, i))
   end function stress_at

   !> Blocks that a group names.
   pure function blocks_of_group(blocks, parameters, group) result(inside)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(in_situ_type), intent(in) :: group
      logical, allocatable :: inside(:)
      if (allocated(group%region) .and. allocated(parameters%regions)) then
         inside = blocks_of_region(blocks, parameters%regions, group%region)
      else
         allocate (inside(blocks%n_blocks), source=.true.)
      end if
   end function blocks_of_group

   !> A stress that is given.
   pure subroutine take_given(group, centroid, stress, gradient)
      type(in_situ_type), intent(in) :: group
      real(wp), intent(in) :: centroid(2)
      real(wp), intent(out) :: stress(3), gradient(3, 2)
      gradient = 0
      if (allocated(group%gradient)) gradient(:, 2) = group%gradient(:, 1)
      stress = group%stress(:, 1) + gradient(:, 2)*centroid(2)
   end subroutine take_given

   !> The stress of the weight above block i.
   pure subroutine take_weight(blocks, columns, group, i, centroid, stress, gradient)
      type(block_system_type), intent(in) :: blocks
      type(columns_type), intent(in) :: columns
      type(in_situ_type), intent(in) :: group
      integer, intent(in) :: i
      real(wp), intent(in) :: centroid(2)
      real(wp), intent(out) :: stress(3), gradient(3, 2)
      real(wp) :: surface, slope, load, at_top, own
      stress = 0
      gradient = 0
      call find_surface(group, centroid(1), surface, slope)
      if (.not. is_below(group, blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)))) return
      ! the centroid of what tapers may lie above
      surface = max(surface, centroid(2))
      if (is_set(group%unit_weight)) then
         own = group%unit_weight
         at_top = own
         load = own*(surface - centroid(2))
      else if (columns%is_uniform) then
         own = columns%unit_weight(i)
         at_top = own
         load = own*(surface - centroid(2))
      else
         own = columns%unit_weight(i)
         call add_up_weight(blocks, columns, i, centroid, surface, load, at_top)
      end if
      if (is_set(group%surcharge)) load = load + group%surcharge
      stress(1:2) = [-group%k0*load, -load]
      gradient(1:2, 1) = -at_top*slope*[group%k0, 1.0_wp]
      gradient(1:2, 2) = own*[group%k0, 1.0_wp]
   end subroutine take_weight

   !> Does more than half of the area of a block lie below the surface?
   pure logical function is_below(group, corners)
      type(in_situ_type), intent(in) :: group
      real(wp), intent(in) :: corners(:, :)      !! (2, n)
      type(shape_type) :: ground(1)
      real(wp), allocatable :: surface(:, :)     !! (2, points)
      real(wp) :: low(2), high(2)
      integer :: n
      low = minval(corners, dim=2)
      high = maxval(corners, dim=2)
      if (allocated(group%profile)) then
         n = size(group%profile, 2)
         allocate (surface(2, n + 4))
         surface(:, 3:n + 2) = group%profile
         ! level beyond the ends
         surface(:, 2) = [min(low(1), surface(1, 3)) - 1, surface(2, 3)]
         surface(:, n + 3) = [max(high(1), surface(1, n + 2)) + 1, surface(2, n + 2)]
      else
         n = 0
         allocate (surface(2, 4))
         surface(:, 2) = [low(1) - 1, group%surface]
         surface(:, 3) = [high(1) + 1, group%surface]
      end if
      is_below = high(2) <= minval(surface(2, 2:n + 3))
      if (is_below .or. low(2) >= maxval(surface(2, 2:n + 3))) return
      surface(:, 1) = [surface(1, 2), min(low(2), minval(surface(2, 2:n + 3))) - 1]
      surface(:, n + 4) = [surface(1, n + 3), surface(2, 1)]
      call set_polygon(ground(1), surface)
      is_below = common_area(corners, ground) > 0.5_wp*abs(polygon_area(corners))
   end function is_below

   !> Height and slope of the surface above a point.
   pure subroutine find_surface(group, x, surface, slope)
      type(in_situ_type), intent(in) :: group
      real(wp), intent(in) :: x
      real(wp), intent(out) :: surface, slope
      integer :: k, n
      slope = 0
      if (.not. allocated(group%profile)) then
         surface = group%surface
         return
      end if
      associate (points => group%profile)
         n = size(points, 2)
         surface = points(2, 1)
         if (x <= points(1, 1)) return
         surface = points(2, n)
         if (x >= points(1, n)) return
         do k = 1, n - 1
            if (x < points(1, k + 1)) exit
         end do
         slope = (points(2, k + 1) - points(2, k))/(points(1, k + 1) - points(1, k))
         surface = points(2, k) + slope*(x - points(1, k))
      end associate
   end subroutine find_surface

   !> Add up the weight of the blocks from the centroid of block i to the surface.
   pure subroutine add_up_weight(blocks, columns, i, centroid, surface, load, at_top)
      type(block_system_type), intent(in) :: blocks
      type(columns_type), intent(in) :: columns
      integer, intent(in) :: i
      real(wp), intent(in) :: centroid(2), surface
      real(wp), intent(out) :: load     !! [force/length]
      real(wp), intent(out) :: at_top   !! unit weight below the surface
      real(wp), allocatable :: pieces(:, :)   !! (3, n) from, to, unit weight
      real(wp) :: y, low, high
      integer :: c, k, n, next
      logical, allocatable :: used(:)
      allocate (pieces(3, 0))
      c = column_of(columns, centroid(1))
      do k = columns%start(c) + 1, columns%start(c + 1)
         associate (box => columns%boxes(:, columns%items(k)))
            if (box(1) > centroid(1) .or. box(3) < centroid(1) .or. box(4) <= centroid(2)) cycle
         end associate
         call add_pieces(blocks, columns%items(k), columns%unit_weight(columns%items(k)), centroid(1), pieces)
      end do
      n = size(pieces, 2)
      allocate (used(n))
      used = .false.
      y = centroid(2)
      load = 0
      at_top = columns%unit_weight(i)
      do k = 1, n
         next = minloc(pieces(1, :), dim=1, mask=.not. used)
         used(next) = .true.
         low = min(surface, pieces(1, next))
         high = min(surface, pieces(2, next))
         if (high <= y) cycle
         ! what no block fills is as heavy as what lies below it
         if (low > y) load = load + at_top*(low - y)
         y = max(y, low)
         at_top = pieces(3, next)
         load = load + at_top*(high - y)
         y = high
      end do
      load = load + at_top*(surface - y)
   end subroutine add_up_weight

   !> Pieces of a vertical line in a block.
   pure subroutine add_pieces(blocks, b, unit_weight, x, pieces)
      type(block_system_type), intent(in) :: blocks
      integer, intent(in) :: b
      real(wp), intent(in) :: unit_weight
      real(wp), intent(in) :: x
      real(wp), allocatable, intent(inout) :: pieces(:, :)
      real(wp) :: y(blocks%vertex_offset(b + 1) - blocks%vertex_offset(b)), upper
      integer :: k, l, m, n, first
      first = blocks%vertex_offset(b)
      n = size(y)
      m = 0
      do k = 1, n
         associate (p => blocks%vertices(:, first + k), q => blocks%vertices(:, first + modulo(k, n) + 1))
            ! each edge without its right end: a line through a corner is counted once
            if (.not. ((p(1) <= x .and. x < q(1)) .or. (q(1) <= x .and. x < p(1)))) cycle
            m = m + 1
            y(m) = p(2) + (x - p(1))/(q(1) - p(1))*(q(2) - p(2))
         end associate
      end do
      do k = 2, m
         do l = k, 2, -1
            if (y(l) >= y(l - 1)) exit
            upper = y(l - 1)
            y(l - 1) = y(l)
            y(l) = upper
         end do
      end do
      do k = 1, m - 1, 2
         pieces = reshape([pieces, y(k), y(k + 1), unit_weight], [3, size(pieces, 2) + 1])
      end do
   end subroutine add_pieces

   !> Boxes and unit weights of the blocks, sorted into columns.
   pure subroutine sort_into_columns(blocks, parameters, columns)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(columns_type), intent(out) :: columns
      integer :: i, c, n, first, last
      integer, allocatable :: place(:)
      allocate (columns%boxes(4, blocks%n_blocks), columns%unit_weight(blocks%n_blocks))
      do i = 1, blocks%n_blocks
         associate (v => blocks%vertices(:, blocks%vertex_offset(i) + 1:blocks%vertex_offset(i + 1)), &
                    m => parameters%block_materials(blocks%block_material(i)))
            columns%boxes(:, i) = [minval(v, dim=2), maxval(v, dim=2)]
            columns%unit_weight(i) = m%weight
            if (parameters%gravity >= 0) columns%unit_weight(i) = m%density*parameters%gravity
         end associate
      end do
      columns%is_uniform = all(abs(columns%unit_weight - columns%unit_weight(1)) <= 0)
      n = max(1, int(sqrt(real(blocks%n_blocks, wp))))
      columns%left = minval(columns%boxes(1, :))
      columns%width = max(tiny(1.0_wp), (maxval(columns%boxes(3, :)) - columns%left)/n)
      allocate (columns%start(n + 1), place(n))
      columns%start = 0
      do i = 1, blocks%n_blocks
         first = column_of(columns, columns%boxes(1, i))
         last = column_of(columns, columns%boxes(3, i))
         columns%start(first + 1:last + 1) = columns%start(first + 1:last + 1) + 1
      end do
      do c = 1, n
         columns%start(c + 1) = columns%start(c + 1) + columns%start(c)
      end do
      allocate (columns%items(columns%start(n + 1)))
      place = columns%start(1:n)
      do i = 1, blocks%n_blocks
         do c = column_of(columns, columns%boxes(1, i)), column_of(columns, columns%boxes(3, i))
            place(c) = place(c) + 1
            columns%items(place(c)) = i
         end do
      end do
   end subroutine sort_into_columns

   !> Column of a point.
   pure integer function column_of(columns, x)
      type(columns_type), intent(in) :: columns
      real(wp), intent(in) :: x
      column_of = 1 + int(max(0.0_wp, min(size(columns%start) - 2.0_wp, (x - columns%left)/columns%width)))
   end function column_of

   !> Groups of &in_situ that say too little, too much or the impossible, in any model.
   subroutine check_in_situ(in_situ, messages)
      type(in_situ_type), intent(in) :: in_situ(:)
      type(diagnostics_type), intent(inout) :: messages
      integer :: g
      do g = 1, size(in_situ)
         call check_group(in_situ(g), messages)
      end do
   end subroutine check_in_situ

   !> Which blocks the groups of &in_situ name. They and their names of regions have been checked.
   subroutine check_in_situ_blocks(blocks, parameters, messages)
      type(block_system_type), intent(in) :: blocks
      type(parameters_type), intent(in) :: parameters
      type(diagnostics_type), intent(inout) :: messages
      logical, allocatable :: named(:), inside(:)
      integer :: g, i, n
      if (size(parameters%in_situ) == 0) return
      allocate (named(blocks%n_blocks), source=.false.)
      do g = 1, size(parameters%in_situ)
         inside = blocks_of_group(blocks, parameters, parameters%in_situ(g))
         if (.not. any(inside)) call messages%add(severity%warning, '&in_situ names no block', &
                                                  parameters%in_situ(g)%origin)
         named = named .or. inside
      end do
      n = 0
      do i = 1, blocks%n_blocks
         associate (m => parameters%block_materials(blocks%block_material(i)))
            if (named(i) .and. (any(abs(m%stress) > 0) .or. any(abs(m%stress_gradient) > 0))) n = n + 1
         end associate
      end do
      if (n > 0) call messages%add(severity%note, '&in_situ replaces the initial stress of the block material in '// &
                                   counted(n, 'block'), parameters%in_situ(1)%origin)
   end subroutine check_in_situ_blocks

   !> One group.
   subroutine check_group(group, messages)
      type(in_situ_type), intent(in) :: group
      type(diagnostics_type), intent(inout) :: messages
      integer :: k
      logical :: by_weight
      if (count([is_set(group%surface), allocated(group%profile), allocated(group%stress)]) /= 1) then
         call fail('give one of surface, profile, stress')
         return
      end if
      by_weight = .not. allocated(group%stress)
      if (by_weight) then
         if (.not. is_set(group%k0)) call fail('k0 is missing')
         if (allocated(group%gradient)) call fail('gradient belongs to stress')
      else
         if (size(group%stress, 2) /= 1) call fail('stress: expected 3 numbers, found '//to_string(size(group%stress)))
         if (is_set(group%k0)) call fail('k0 belongs to surface or profile')
         if (is_set(group%unit_weight)) call fail('unit_weight belongs to surface or profile')
         if (is_set(group%surcharge)) call fail('surcharge belongs to surface or profile')
         if (allocated(group%gradient)) then
            if (size(group%gradient, 2) /= 1) call fail('gradient: expected 3 numbers, found '// &
                                                        to_string(size(group%gradient)))
         end if
      end if
      if (.not. allocated(group%profile)) return
      if (size(group%profile, 2) < 2) call fail('profile: at least two points are needed, found '// &
                                                to_string(size(group%profile, 2)))
      do k = 2, size(group%profile, 2)
         if (group%profile(1, k) > group%profile(1, k - 1)) cycle
         call fail('profile: x must increase, point '//to_string(k)//' has '//to_string(group%profile(1, k))// &
                   ' after '//to_string(group%profile(1, k - 1)))
         exit
      end do

   contains

      !> An error about the group.
      subroutine fail(text)
         character(len=*), intent(in) :: text
         call messages%add(severity%error, '&in_situ: '//text, group%origin)
      end subroutine fail

   end subroutine check_group

end module rockdda_model_in_situ
