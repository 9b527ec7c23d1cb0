! SPDX-License-Identifier: MIT
!> Numbers of bolts and linings that do not fit each other: ratios without units, which a slip of a unit, or of a digit,
!> moves far from what steel and shotcrete have; and linings that lie in one place. Numbers that cannot be by
!> themselves are found where they are read (rockdda_model_possible_values).
module rockdda_check_support_numbers
   use rockdda_base_kinds, only : wp
   use rockdda_base_diagnostics, only : diagnostics_type, origin_type, severity
   use rockdda_base_strings, only : to_string
   use rockdda_geometry_segments, only : distance_to_segment
   use rockdda_model_bolt_layout, only : stage_with, title_of_bolt
   use rockdda_model_geometry_input, only : is_spring
   use rockdda_model_liner_layout, only : title_of_liner, lower_liner
   use rockdda_model_options, only : run_options_type, change_type, is_set
   implicit none
   private
   public :: line_type, check_numbers_of_liner, check_change, check_same_place, check_numbers_of_bolt

   real(wp), parameter :: pi = acos(-1.0_wp)
   !> Linings that share less of their lines are neighbours.
   real(wp), parameter :: least_share = 0.02_wp

   !> Line of a lining.
   type :: line_type
      real(wp), allocatable :: xy(:)        !! of its points; empty: it is wrong, which was reported [length]
   end type line_type

   !> A ratio, what it usually is, and bounds beyond which it is reported.
   type :: ratio_type
      character(len=64) :: name = ''
      real(wp) :: least = 0, most = huge(1.0_wp)
      character(len=96) :: usual = ''
   end type ratio_type

   type(ratio_type), parameter :: thickness_over_span = ratio_type('thickness over the extent of its line', 1.0e-4_wp, &
      0.25_wp, '0.01 to 0.1')
   type(ratio_type), parameter :: young_over_strength = ratio_type('young over compressive_strength', 30.0_wp, &
      2.0e4_wp, '300 to 2000 (30 GPa over 30 MPa is 1000)')
   type(ratio_type), parameter :: young_over_tension = ratio_type('young over tensile_strength', 30.0_wp, 1.0e6_wp, &
      '3000 to 30,000 (30 GPa over 3 MPa is 10,000)')
   type(ratio_type), parameter :: tension_over_compression = ratio_type('tensile_strength over compressive_strength', &
      0.0_wp, 1.0_wp, '0.05 to 0.2')
   type(ratio_type), parameter :: young_over_rock = ratio_type('young over that of the first block material', &
      1.0e-4_wp, 1.0e5_wp, '0.1 to 100')
   type(ratio_type), parameter :: yield_strain = ratio_type('yield_force over young and the cross-section', 1.0e-4_wp, &
      0.04_wp, '0.001 to 0.01 (500 MPa over 200 GPa is 0.0025)')
   type(ratio_type), parameter :: plateau_strain = ratio_type('plateau_force over young and the cross-section', &
      1.0e-5_wp, 0.04_wp, '0.0005 to 0.01')
   type(ratio_type), parameter :: slenderness = ratio_type('diameter over the length of the bolt', 2.0e-4_wp, 0.2_wp, &
      '0.002 to 0.02')
   type(ratio_type), parameter :: slip_at_strength = ratio_type('grout_strength over grout_stiffness and diameter', &
      1.0e-5_wp, 2.0_wp, '0.001 to 0.3 (400 kN/m over 1 GN/m2 and 25 mm is 0.016)')

contains

   !> Numbers of lining k that do not fit each other, or the rock.
   subroutine check_numbers_of_liner(k, options, line, messages)
      integer, intent(in) :: k
      type(run_options_type), intent(in) :: options
      real(wp), intent(in) :: line(:)               !! x y of its points [length]
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: extent
      associate (liner => options%liners(k))
         if (size(line) > 0) then
            extent = max(maxval(line(1::2)) - minval(line(1::2)), maxval(line(2::2)) - minval(line(2::2)))
            call judge(thickness_over_span, liner%thickness, extent)
         end if
         call judge(young_over_strength, liner%young, liner%compressive_strength)
         call judge(young_over_tension, liner%young, liner%tensile_strength)
         call judge(tension_over_compression, liner%tensile_strength, liner%compressive_strength)
         if (allocated(options%block_materials)) then
            if (size(options%block_materials) > 0) call judge(young_over_rock, liner%young, &
                                                              options%block_materials(1)%youngs_modulus)
         end if
      end associate

   contains

      !> One ratio.
      subroutine judge(ratio, a, b)
         type(ratio_type), intent(in) :: ratio
         real(wp), intent(in) :: a, b
         call judge_ratio(ratio, a, b, "liner '"//title_of_liner(options%liners(k), k)//"'", &
                          options%liners(k)%origin, messages)
      end subroutine judge

   end subroutine check_numbers_of_liner

   !> The modulus that a change gives a lining, or rock, against that of the rock.
   subroutine check_change(change, options, messages)
      type(change_type), intent(in) :: change
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      if (.not. allocated(options%block_materials)) return
      if (size(options%block_materials) == 0) return
      call judge_ratio(young_over_rock, change%young, options%block_materials(1)%youngs_modulus, '&change', &
                       change%origin, messages)
   end subroutine check_change

   !> Numbers of one group of bolts that do not fit each other.
   subroutine check_numbers_of_bolt(g, options, messages)
      integer, intent(in) :: g
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      real(wp) :: area, diameter, stiffness
      associate (bolt => options%bolts(g))
         if (is_spring(bolt)) return
         area = bolt%area
         if (is_set(bolt%diameter)) area = 0.25_wp*pi*bolt%diameter**2
         if (.not. is_set(area)) return
         diameter = sqrt(4*area/pi)
         if (is_set(bolt%young)) then
            stiffness = bolt%young*area
            call judge(yield_strain, bolt%yield_force, stiffness)
            call judge(plateau_strain, bolt%plateau_force, stiffness)
         end if
         if (is_set(bolt%length)) call judge(slenderness, diameter, bolt%length)
         if (is_set(bolt%grout_stiffness)) call judge(slip_at_strength, bolt%grout_strength, &
                                                      bolt%grout_stiffness*diameter)
      end associate

   contains

      !> One ratio.
      subroutine judge(ratio, a, b)
         type(ratio_type), intent(in) :: ratio
         real(wp), intent(in) :: a, b
         call judge_ratio(ratio, a, b, "bolt '"//title_of_bolt(options%bolts(g), g)//"'", options%bolts(g)%origin, &
                          messages)
      end subroutine judge

   end subroutine check_numbers_of_bolt

   !> Report a ratio beyond its bounds, where both numbers are given and not 0.
   subroutine judge_ratio(ratio, a, b, who, origin, messages)
      type(ratio_type), intent(in) :: ratio
      real(wp), intent(in) :: a, b
      character(len=*), intent(in) :: who
      type(origin_type), intent(in) :: origin
      type(diagnostics_type), intent(inout) :: messages
      if (.not. (is_set(a) .and. is_set(b))) return
      if (.not. (a > 0 .and. b > 0)) return
      if (a >= ratio%least*b .and. a <= ratio%most*b) return
      call messages%add(severity%warning, who//': '//trim(ratio%name)//' is '//to_string(a/b, 3)//' ('// &
                        to_string(a, 4)//' over '//to_string(b, 4)//'), usual is '//trim(ratio%usual)// &
                        '. Is one of them in another unit, or a digit wrong?', origin)
   end subroutine judge_ratio

   !> Lining k where others before it lie at the same time: each carries as if it lay on the rock alone.
   subroutine check_same_place(k, lines, options, messages)
      integer, intent(in) :: k
      type(line_type), intent(in) :: lines(:)       !! of the linings up to k
      type(run_options_type), intent(in) :: options
      type(diagnostics_type), intent(inout) :: messages
      character(len=:), allocatable :: place
      real(wp) :: share
      integer :: j
      associate (liners => options%liners)
         do j = 1, k - 1
            if (.not. at_one_time(j)) cycle
            if (lower_liner(liners, j) /= lower_liner(liners, k)) cycle
            place = ''
            if (lower_liner(liners, k) > 0) then
               place = "both lie on '"//title_of_liner(liners(lower_liner(liners, k)), lower_liner(liners, k))//"'"
            else
               if (size(lines(j)%xy) < 4 .or. size(lines(k)%xy) < 4) cycle
               share = share_beside(lines(k)%xy, lines(j)%xy, 0.25_wp*min(liners(j)%thickness, liners(k)%thickness))
               if (share < least_share) cycle
               place = to_string(100*share, 2)//' % of its line'
            end if
            call messages%add(severity%warning, "liner '"//title_of_liner(liners(k), k)//"' lies where lining '"// &
               title_of_liner(liners(j), j)//"' lies at the same time ("//place//'): both carry, and neither feels '// &
               "of the other; a layer on it is given by on = '"//title_of_liner(liners(j), j)//"', "// &
               'and `remove` of a stage takes one out', liners(k)%origin)
         end do
      end associate

   contains

      !> Are linings j and k there at the same time?
      pure logical function at_one_time(j)
         integer, intent(in) :: j
         integer :: first(2), gone(2), i, who
         do i = 1, 2
            who = merge(j, k, i == 1)
            first(i) = stage_with(options%stages, title_of_liner(options%liners(who), who), installs=.true.)
            gone(i) = stage_with(options%stages, title_of_liner(options%liners(who), who), installs=.false.)
            if (gone(i) == 0) gone(i) = huge(1)
         end do
         at_one_time = first(1) < gone(2) .and. first(2) < gone(1)
      end function at_one_time

   end subroutine check_same_place

   !> Share of a line that lies closer to another one than a distance, by points along it.
   pure real(wp) function share_beside(line, other, reach) result(share)
      real(wp), intent(in) :: line(:), other(:)     !! x y of their points [length]
      real(wp), intent(in) :: reach                 !! [length]
      integer, parameter :: n = 200
      real(wp) :: lengths(size(line)/2 - 1), at, along
      integer :: hits, i, j, k
      lengths = [(norm2(line(2*k + 1:2*k + 2) - line(2*k - 1:2*k)), k=1, size(lengths))]
      share = 0
      if (.not. sum(lengths) > 0) return
      hits = 0
      k = 1
      along = 0
      do i = 1, n
         at = sum(lengths)*(i - 0.5_wp)/n
         do while (k < size(lengths) .and. along + lengths(k) < at)
            along = along + lengths(k)
            k = k + 1
         end do
         if (.not. lengths(k) > 0) cycle
         associate (point => line(2*k - 1:2*k) + (at - along)/lengths(k)*(line(2*k + 1:2*k + 2) - line(2*k - 1:2*k)))
            do j = 1, size(other)/2 - 1
               if (distance_to_segment(point, other(2*j - 1:2*j), other(2*j + 1:2*j + 2)) > reach) cycle
               hits = hits + 1
               exit
            end do
         end associate
      end do
      share = real(hits, wp)/n
   end function share_beside

end module rockdda_check_support_numbers
